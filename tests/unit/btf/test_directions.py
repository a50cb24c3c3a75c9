"""Directions and the coordinates of models: known counts, inverses, no seam."""

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from neumat.brdf.coordinates import rusinkiewicz
from neumat.btf import directions as d

angles = st.floats(0, math.radians(89.9)), st.floats(-math.pi, math.pi)


def at(theta, phi):
    return d.spherical(torch.tensor([theta]).double(), torch.tensor([phi]).double())


@pytest.mark.parametrize(
    ("found", "counts"),
    [
        (d.ubo2014_directions(), (1, 6, 12, 12, 12, 18, 18, 24, 24, 24)),
        (d.ubo2003_directions(), (1, 6, 12, 18, 20, 24)),
    ],
)
def test_measured_directions_are_rings_of_the_published_counts(found, counts):
    assert found.shape == (sum(counts), 3)
    rings = torch.acos(found[:, 2].clamp_max(1)).rad2deg().round(decimals=1).unique(return_counts=True)
    assert tuple(rings[1].tolist()) == counts
    assert rings[0][-1] == 75


@given(*angles)
def test_concentric_map_is_inverted(theta, phi):
    direction = at(theta, phi)
    square = d.concentric_square(direction)
    assert ((square >= 0) & (square <= 1)).all()
    assert torch.allclose(d.concentric_direction(square), direction, atol=1e-9)


def test_concentric_map_keeps_the_share_of_angles_and_puts_the_horizon_on_the_border():
    assert torch.equal(d.concentric_square(torch.tensor([[0.0, 0.0, 1.0]])), torch.full((1, 2), 0.5))
    for phi in torch.linspace(-3, 3, 7).tolist():
        largest = [(d.concentric_square(at(math.radians(t), phi)) - 0.5).abs().max().item() for t in (45, 90, 120)]
        assert largest == pytest.approx([0.25, 0.5, 0.5])


@given(*angles, *angles)
def test_half_and_difference_vectors_give_light_and_view_back(theta_i, phi_i, theta_o, phi_o):
    light, view = at(theta_i, phi_i), at(theta_o, phi_o)
    h, difference = d.half_difference(light, view)
    assert torch.linalg.vector_norm(difference).item() == pytest.approx(1)
    for found, expected in zip(d.light_view(h, difference), (light, view), strict=True):
        assert torch.allclose(found, expected, atol=1e-6)


def test_difference_is_the_light_where_h_is_the_normal_and_has_no_seam_there():
    light = at(0.6, 0.9)
    mirrored = light * torch.tensor([-1.0, -1.0, 1.0])
    assert torch.allclose(d.half_difference(light, mirrored)[1], light)
    around = torch.stack([at(0.6 + 1e-4 * math.cos(a), 0.9 + math.pi + 1e-4 * math.sin(a))[0] for a in range(7)])
    assert torch.allclose(d.half_difference(light, around)[1], light.expand(7, 3), atol=2e-4)


@given(*angles, *angles)
def test_papers_angles_are_rusinkiewiczs(theta_i, phi_i, theta_o, phi_o):
    light, view = at(theta_i, phi_i), at(theta_o, phi_o)
    theta_h, phi_h, theta_d, phi_d = d.paper_half_difference(light, view)
    h = d.half_difference(light, view)[0]
    assert torch.allclose(d.spherical(theta_h, phi_h), h, atol=1e-6)
    expected = rusinkiewicz(light, view)
    assert theta_h.item() == pytest.approx(expected[0].item(), abs=1e-9)
    assert theta_d.item() == pytest.approx(expected[1].item(), abs=1e-9)
    turned = 2 * (phi_d - expected[2])  # those are folded by pi
    assert math.sin(theta_d) * (1 - math.cos(turned)) < 1e-6


def test_opposite_directions_on_the_horizon_give_finite_coordinates():
    light = torch.tensor([[1.0, 0.0, 0.0]])
    for found in (*d.half_difference(light, -light), *d.paper_half_difference(light, -light)):
        assert found.isfinite().all()


def test_random_directions_fill_the_disk_evenly():
    light, view = d.random_pairs(20000, torch.Generator().manual_seed(0), math.radians(80))
    theta = torch.acos(light[:, 2])
    assert theta.max() <= math.radians(80) + 1e-6
    assert (theta < math.radians(40)).float().mean().item() == pytest.approx(0.25, abs=0.02)
    assert light.mean(0)[:2].abs().max() < 0.02
    assert not torch.equal(light, view)
