import math

import pytest
import torch

from neumat.btf.synthesis.autocovariance import Autocovariance
from neumat.btf.synthesis.histogram import Histogram
from neumat.btf.synthesis.lattice import autocovariance, cell_sides
from neumat.seeds import torch_generator


def lattice(first, second, size, noise=0.3):
    """Waves on the lattice of two lags (x, y), with noise that is different everywhere; values at any texel."""
    (a, b), (c, d) = first, second
    area = a * d - b * c
    y, x = torch.meshgrid(torch.arange(size), torch.arange(size), indexing="ij")
    f, g = (d * x - c * y) / area, (a * y - b * x) / area
    plane = torch.cos(2 * math.pi * f) + torch.cos(2 * math.pi * g)
    return (plane + noise * torch.randn(size, size, generator=torch_generator(1)))[..., None]


def picture(method, size, cells):
    a = (torch.arange(cells * size, dtype=torch.float64) + 0.5) / size
    y, x = torch.meshgrid(a, a, indexing="ij")
    return method.at(torch.stack([x, y], -1).reshape(-1, 2)).reshape(cells * size, cells * size, -1)


def test_autocorrelation_of_a_wave_is_a_wave():
    plane = lattice((16, 0), (0, 16), 64, noise=0)
    found = autocovariance(plane, True)
    lag = torch.arange(-63, 64)
    expected = (torch.cos(lag * math.pi / 8)[:, None] + torch.cos(lag * math.pi / 8)) / 2
    assert torch.allclose(found, expected.double(), atol=1e-5)
    assert found[63, 63] == 1


def test_autocorrelation_of_a_plane_that_does_not_tile_counts_its_pairs():
    plane = torch.randn(9, 7, 2, generator=torch_generator(2))
    centred = plane - plane.mean((0, 1))
    found = autocovariance(plane, False)
    expected = (centred[3:, :-2] * centred[:-3, 2:]).sum(-1).mean() / centred.square().sum(-1).mean()
    assert torch.allclose(found[8 - 3, 6 + 2], expected.double(), atol=1e-5)


@pytest.mark.parametrize("sides", [((11.3, 0), (0, 9.6)), ((14, 0), (7, 6.2)), ((10, 4), (-4, 10))])
def test_cells_are_multiples_of_the_lattice(sides):
    (a, b), (c, d) = sides
    plane = lattice(*sides, 96)
    found, like = cell_sides(autocovariance(plane, False), 96 * 96 / 18, (55, 55))
    assert like > 0.8
    for x, y in found:
        f, g = (d * x - c * y) / (a * d - b * c), (a * y - b * x) / (a * d - b * c)
        assert abs(f - round(f)) < 0.03 and abs(g - round(g)) < 0.03


@pytest.mark.parametrize("tileable", [True, False])
def test_a_lattice_goes_on_where_blending_at_random_breaks_it(tileable):
    sides = ((12, 0), (6, 8)) if tileable else ((11.3, 1), (-0.7, 9.6))
    plane = lattice(*sides, 96)
    truth = autocovariance(lattice(*sides, 384), False)[300:470, 300:470]
    errors = [
        (autocovariance(picture(method(plane, 1, tileable), 96, 4), False)[300:470, 300:470] - truth).square().mean()
        for method in (Autocovariance, Histogram)
    ]
    assert errors[0].sqrt() < 0.35 * errors[1].sqrt()


def test_patches_keep_inside_an_exemplar_that_does_not_tile():
    method = Autocovariance(lattice((11.3, 1), (-0.7, 9.6), 96), 1)
    cell = torch.randint(-(10**6), 10**6, (20_000, 2), generator=torch_generator(3))
    fraction = torch.rand(20_000, 2, dtype=torch.float64, generator=torch_generator(4))
    positions, weights = method._patches(cell, fraction)
    assert (positions * 96).min() >= 0.5 and (positions * 96).max() <= 95.5
    assert torch.allclose(weights.sum(1), torch.ones(20_000), atol=1e-6)
    texels = (positions - fraction[:, None]) * 96
    assert (texels - texels.round()).abs().max() < 1e-6


def test_cells_differ():
    plane = lattice((12, 0), (0, 12), 96)
    found = picture(Autocovariance(plane, 1, True), 96, 3)
    tiles = found.unfold(0, 96, 96).unfold(1, 96, 96).reshape(9, -1)
    assert torch.corrcoef(tiles)[0, 1:].max() < 0.97  # of copies 1, of the lattice alone 0.92
