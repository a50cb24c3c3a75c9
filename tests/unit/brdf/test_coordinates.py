import math

import pytest
import torch

from neumat.brdf.coordinates import (
    ENTRIES,
    above_horizon,
    cosines,
    directions,
    grid_angles,
    half_difference,
    rusinkiewicz,
)


def random_entries(count=5000):
    entries = torch.nonzero(above_horizon())[:, 0]
    return entries[torch.randperm(len(entries), generator=torch.Generator().manual_seed(0))[:count]]


def test_directions_and_angles_are_inverse():
    angles = [angle.double() for angle in grid_angles(random_entries())]
    wi, wo = directions(*angles)
    for direction in (wi, wo):
        torch.testing.assert_close(direction.norm(dim=1), torch.ones(len(direction), dtype=torch.float64))
    theta_h, theta_d, phi_d = rusinkiewicz(wi, wo)
    torch.testing.assert_close(theta_h, angles[0])
    torch.testing.assert_close(theta_d, angles[1])
    apart = (phi_d - angles[2]).abs()
    # At phi_d = 0 rounding may put the angle just below pi, which is the same direction.
    assert torch.minimum(apart, math.pi - apart)[angles[1] > 0].max() < 1e-6


def test_swapping_light_and_view_is_the_same_query():
    angles = [angle.double() for angle in grid_angles(random_entries())]
    wi, wo = directions(*angles)
    here, swapped = (half_difference(*rusinkiewicz(*pair)) for pair in ((wi, wo), (wo, wi)))
    inside = (angles[2] > 1e-3) & (angles[1] > 0)
    torch.testing.assert_close(here[inside], swapped[inside], atol=1e-9, rtol=0)


def test_turning_both_directions_about_the_normal_changes_nothing():
    wi, wo = directions(*(angle.double() for angle in grid_angles(random_entries())))
    turn = torch.tensor([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]], dtype=torch.float64)
    here, turned = rusinkiewicz(wi, wo), rusinkiewicz(wi @ turn.T, wo @ turn.T)
    torch.testing.assert_close(here[0], turned[0])
    torch.testing.assert_close(here[1], turned[1], atol=1e-7, rtol=0)


def test_cosines_are_the_z_of_the_directions():
    angles = [angle.double() for angle in grid_angles(random_entries())]
    wi, wo = directions(*angles)
    cos_i, cos_o = cosines(*angles)
    torch.testing.assert_close(cos_i, wi[:, 2])
    torch.testing.assert_close(cos_o, wo[:, 2])


def test_three_quarters_of_the_grid_lie_above_the_horizon():
    assert above_horizon().sum() / ENTRIES == pytest.approx(0.762, abs=1e-3)
