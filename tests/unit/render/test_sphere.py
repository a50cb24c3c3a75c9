import math

import pytest
import torch

from neumat.brdf.analytic import GGX, Lambert
from neumat.brdf.coordinates import rusinkiewicz
from neumat.errors import NeumatError
from neumat.fields.field import evaluate
from neumat.fields.layout import SIZE, permute_channels
from neumat.render import scene
from neumat.render.sphere import FrozenSphere, radiance_fields, render_fields
from neumat.seeds import torch_generator


@pytest.fixture(scope="module")
def frozen():
    return FrozenSphere(64, rings=96, azimuths=128)


@pytest.fixture(scope="module")
def weights():
    return 0.3 * torch.randn(5, SIZE, generator=torch_generator(0, "test_sphere"))


def values(frozen, material):
    return material.eval(frozen.theta_h, frozen.theta_d, frozen.phi_d).T[None]


def dense_radiance(material, x, y):
    """Return the radiance (3,) at a point of the sphere, by a midpoint rule over the hemisphere of light."""
    n = torch.tensor([x, y, math.sqrt(1 - x * x - y * y)], dtype=torch.float64)
    t = (torch.arange(300, dtype=torch.float64) + 0.5) / 300 * math.pi / 2
    p = (torch.arange(600, dtype=torch.float64) + 0.5) / 600 * 2 * math.pi
    t, p = (a.flatten() for a in torch.meshgrid(t, p, indexing="ij"))
    local = torch.stack([t.sin() * p.cos(), t.sin() * p.sin(), t.cos()], -1)
    # Any frame about n will do: the material is isotropic.
    tangent = torch.nn.functional.normalize(torch.linalg.cross(torch.tensor([0.3, 0.9, 0.1]).double(), n), dim=0)
    frame = torch.stack([tangent, torch.linalg.cross(n, tangent), n])
    view = frame @ torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
    f = material.eval(*rusinkiewicz(local, view.expand_as(local))).double()
    solid = t.sin() * (math.pi / 2 / 300) * (2 * math.pi / 600)
    return (f * (scene.environment(local @ frame) * t.cos() * solid)[:, None]).sum(0)


def test_lambert_under_constant_light_has_the_radiance_of_its_albedo():
    sphere = FrozenSphere(32, environment=lambda d: torch.full_like(d[..., 0], 2.0))
    albedo = torch.tensor([0.8, 0.5, 0.1])
    picture = sphere.pictures(values(sphere, Lambert(albedo)))[0].flatten(0, 1)
    on_sphere = sphere.coverage[:, 0] == 1
    assert torch.allclose(picture[on_sphere], 2 * albedo.expand(int(on_sphere.sum()), 3), rtol=3e-3)
    background = picture[sphere.coverage[:, 0] == 0]
    assert torch.equal(background, torch.full_like(background, scene.BACKGROUND))


def test_coverage_is_the_area_of_the_disc(frozen):
    assert abs(frozen.coverage.mean() - math.pi * scene.RADIUS**2 / 4) < 1e-3


@pytest.mark.parametrize("material", [Lambert(0.7), GGX(0.3, 0.9), GGX(0.1, [0.9, 0.6, 0.3])])
def test_picture_against_dense_integration_at_single_pixels(material):
    sphere = FrozenSphere(255)
    picture = sphere.pictures(values(sphere, material))[0]
    for column, row in ((127, 127), (80, 70), (60, 180), (90, 20)):
        x, y = ((column + 0.5) / 255 * 2 - 1) / scene.RADIUS, (1 - (row + 0.5) / 255 * 2) / scene.RADIUS
        expected = dense_radiance(material, x, y).float()
        assert torch.allclose(picture[row, column], expected, rtol=0.02, atol=2e-3)


def test_pictures_are_linear(frozen):
    a, b = values(frozen, Lambert([0.7, 0.2, 0.1])), values(frozen, GGX(0.2, 0.8))
    black = frozen.pictures(torch.zeros_like(a))
    mixed = frozen.pictures(2 * a + 3 * b) - black
    apart = 2 * (frozen.pictures(a) - black) + 3 * (frozen.pictures(b) - black)
    assert torch.allclose(mixed, apart, rtol=1e-4, atol=1e-5)


def test_fields_are_rendered_as_their_values(frozen, weights):
    at_queries = evaluate(weights, frozen.theta_h, frozen.theta_d, frozen.phi_d).mT
    assert torch.allclose(radiance_fields(frozen, weights), frozen.pictures(at_queries), rtol=1e-4, atol=1e-5)


def test_a_channel_permutation_permutes_the_picture_exactly(frozen, weights):
    permuted = render_fields(frozen, permute_channels(weights, "gbr"))
    assert torch.equal(permuted, render_fields(frozen, weights)[..., [1, 2, 0]])


def test_a_picture_does_not_depend_on_its_batch_or_on_the_sphere_object(frozen, weights):
    together = render_fields(frozen, weights)
    again = FrozenSphere(64, rings=96, azimuths=128)
    alone = torch.cat([render_fields(again, one) for one in weights.split(1)])
    difference = (together.int() - alone.int()).abs()
    # Matrix products of other sizes round differently in the last bit.
    assert difference.max() <= 1 and (difference > 0).float().mean() < 1e-3


def test_broken_fields_still_give_a_picture(frozen):
    broken = torch.full((2, SIZE), math.nan)
    broken[1] = 1e3
    pictures = render_fields(frozen, broken)
    assert pictures.dtype == torch.uint8 and pictures.shape == (2, 64, 64, 3)


def test_weights_of_another_size_are_refused(frozen):
    with pytest.raises(NeumatError, match="675"):
        render_fields(frozen, torch.zeros(1, 100))
