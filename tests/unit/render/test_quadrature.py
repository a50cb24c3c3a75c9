import math

import pytest
import torch

from neumat.brdf.analytic import GGX
from neumat.brdf.coordinates import rusinkiewicz
from neumat.render.quadrature import cosine_lobe, fibonacci_lattice, ggx_density, ggx_lobe, hemisphere

THETA = torch.tensor([0.01, 0.5, 1.0, 1.4], dtype=torch.float64)


def grid(polar, azimuths):
    """Return directions (n, 3) of a midpoint rule over the upper hemisphere, and solid angles (n,)."""
    t = (torch.arange(polar, dtype=torch.float64) + 0.5) / polar * math.pi / 2
    p = (torch.arange(azimuths, dtype=torch.float64) + 0.5) / azimuths * 2 * math.pi
    t, p = torch.meshgrid(t, p, indexing="ij")
    directions = torch.stack([t.sin() * p.cos(), t.sin() * p.sin(), t.cos()], -1).reshape(-1, 3)
    return directions, (t.sin() * (math.pi / 2 / polar) * (2 * math.pi / azimuths)).flatten()


def test_lattice_is_even():
    u = fibonacci_lattice(610)
    for box in (0.25, 0.5, 0.75):
        share = ((u[:, 0] < box) & (u[:, 1] < box)).double().mean()
        assert abs(share - box**2) < 0.01


def test_cosine_lobe_is_on_the_hemisphere_with_its_mean_height():
    directions = cosine_lobe(fibonacci_lattice(610))
    assert torch.allclose(directions.norm(dim=-1), torch.ones(610, dtype=torch.float64))
    assert abs(directions[:, 2].mean() - 2 / 3) < 1e-3


@pytest.mark.parametrize("alpha", [0.5, 0.2])
def test_ggx_directions_follow_their_density(alpha):
    u = torch.rand(200_000, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    view = torch.tensor([[math.sin(0.8), 0.0, math.cos(0.8)]], dtype=torch.float64)
    drawn = ggx_lobe(u, view, alpha)[0]
    directions, solid = grid(200, 400)
    density = ggx_density(directions[None], view, alpha)[0] * solid
    # Shares of the hemisphere's 4 x 8 cells, drawn and integrated.
    cells = torch.linspace(0, 1, 5, dtype=torch.float64)[1:-1].contiguous()
    sectors = torch.linspace(-math.pi, math.pi, 9, dtype=torch.float64)[1:-1].contiguous()

    def shares(d, weight):
        index = torch.bucketize(d[:, 2].contiguous(), cells) * 8 + torch.bucketize(
            torch.atan2(d[:, 1], d[:, 0]), sectors
        )
        return torch.zeros(32, dtype=torch.float64).index_add_(0, index, weight)

    above = drawn[:, 2] > 0
    expected = shares(directions, density)
    found = shares(drawn[above], torch.full((int(above.sum()),), 1 / len(drawn), dtype=torch.float64))
    assert (found - expected).abs().max() < 0.006


def test_weights_integrate_the_cosine():
    weight = hemisphere(THETA)[2]
    assert torch.allclose(weight.sum(1), torch.full((4,), math.pi, dtype=torch.float64), rtol=3e-3)


@pytest.mark.parametrize(("alpha", "tolerance"), [(0.5, 0.005), (0.1, 0.005)])
def test_ggx_reflectance_against_a_dense_grid(alpha, tolerance):
    material = GGX(alpha, 0.8)
    light, view, weight = hemisphere(THETA)
    directions, solid = grid(500, 1000)
    for ring in range(len(THETA)):
        ours = (material.eval(*rusinkiewicz(light[ring], view[ring]))[:, 0].double() * weight[ring])[weight[ring] > 0]
        dense = material.eval(*rusinkiewicz(directions, view[ring]))[:, 0].double() * directions[:, 2] * solid
        assert abs(ours.sum() / dense.sum() - 1) < tolerance


def test_sharp_mirrors_keep_their_energy():
    # At normal incidence and small roughness a GGX mirror reflects f0, up to its long tail.
    light, view, weight = hemisphere(torch.tensor([0.02], dtype=torch.float64))
    for alpha in (0.05, 0.01, 0.003):
        values = GGX(alpha, 0.8).eval(*rusinkiewicz(light[0], view[0]))[:, 0].double()
        assert abs((values * weight[0]).sum() / 0.8 - 1) < 0.02
