import pytest
import torch

from neumat.btf.synthesis.gaussian import gaussianise
from neumat.btf.synthesis.histogram import Histogram
from neumat.btf.synthesis.linear import Linear
from neumat.seeds import torch_generator


def texel_centres(cells, size):
    """Centres of random texels within `cells` exemplars along each side."""
    texel = torch.randint(0, cells * size, (200_000, 2), generator=torch_generator(1))
    return (texel.double() + 0.5) / size


@pytest.fixture(scope="module")
def gaussian_noise():
    plane = torch.randn(128, 128, 2, generator=torch_generator(2))
    return (plane - plane.mean((0, 1))) / plane.std((0, 1)) * torch.tensor([1.0, 3.0]) + torch.tensor([5.0, -2.0])


@pytest.mark.parametrize("decorrelate", [True, False])
def test_blending_keeps_mean_and_variance_of_gaussian_noise(gaussian_noise, decorrelate):
    features = Histogram(gaussian_noise, 3, True, decorrelate=decorrelate).at(texel_centres(100, 128))
    assert torch.allclose(features.mean(0), gaussian_noise.mean((0, 1)), atol=0.01 * 3)
    assert torch.allclose(features.var(0), gaussian_noise.var((0, 1)), rtol=0.01)


def test_linear_blending_loses_the_variance_that_its_weights_say(gaussian_noise):
    variance = Linear(gaussian_noise, 3, True).at(texel_centres(100, 128)).var(0)
    # The mean of the sum of squares of barycentric coordinates over a triangle is 3 * 1/6.
    assert torch.allclose(variance, gaussian_noise.var((0, 1)) / 2, rtol=0.02)


def test_a_skewed_histogram_is_kept():
    plane = torch.rand(96, 96, 1, generator=torch_generator(4)) ** 4
    features = Histogram(plane, 1, True).at(texel_centres(100, 96))
    shares = torch.linspace(0.05, 0.95, 10)
    assert torch.allclose(features.quantile(shares), plane.flatten().quantile(shares), atol=0.01)


def test_gaussian_values_have_the_ranks_of_the_plane():
    plane = torch.randn(20, 30, 2, generator=torch_generator(5)).exp()
    gaussian, quantiles = gaussianise(plane, torch.ones(plane.shape[:2]))
    assert torch.equal(gaussian.flatten(0, 1).argsort(0), plane.flatten(0, 1).argsort(0))
    assert torch.equal(quantiles, plane.flatten(0, 1).sort(0).values)
    assert torch.allclose(gaussian.mean((0, 1)), torch.zeros(2), atol=1e-5)
    assert torch.allclose(gaussian.var((0, 1)), torch.ones(2), atol=0.02)


def test_equal_values_are_ordered_by_their_surroundings():
    plane = torch.zeros(32, 32, 1)
    plane[:, 16:] = 1
    gaussian, _ = gaussianise(plane, torch.ones(plane.shape[:2]))
    assert gaussian[:, 8].mean() < gaussian[:, 14].mean() < 0 < gaussian[:, 17].mean() < gaussian[:, 23].mean()


def test_decorrelated_channels_stay_correlated():
    first = torch.randn(64, 64, 1, generator=torch_generator(6))
    plane = torch.cat([first, 2 * first + 0.1 * torch.randn(64, 64, 1, generator=torch_generator(7))], -1)
    features = Histogram(plane, 1, True).at(texel_centres(50, 64))
    assert torch.corrcoef(features.T)[0, 1] > 0.99


def test_the_tables_of_levels_are_means_over_what_prefiltering_took_away():
    plane = torch.randn(64, 64, 1, generator=torch_generator(8))
    for axis in (0, 1):
        plane = sum(plane.roll(shift, axis) for shift in range(8))
    plane = torch.exp(plane / plane.std())  # skewed, and smooth enough for bilinear fetches
    method = Histogram(plane, 1, True)
    u = texel_centres(100, 64)
    for level in (1, 3, 6):
        assert torch.allclose(method.at(u, level).mean(), plane.mean(), rtol=0.03)
