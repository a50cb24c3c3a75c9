"""What pictures say of the conventions they are read by, and that they say nothing where they can't."""

import math

import pytest
import torch

from neumat.btf.conventions import CURL, Witness
from neumat.btf.directions import grid, ubo2003_directions

SIDE = 24
LIGHT, VIEW = grid(ubo2003_directions()[[0, 9]], ubo2003_directions())


def witness(values, light=LIGHT, view=VIEW, parts=50):
    """Return the Witness of pictures that all look like `values` (s, 1 or side, 1 or side), in parts."""
    found = Witness(light, view, SIDE)
    for first in range(0, len(light), parts):
        part = slice(first, min(first + parts, len(light)))
        found.add(part, values[part, ..., None].expand(-1, SIDE, SIDE, 3))
    return found


def bumps(light, sign=1.0):
    """Return a Lambertian surface of height 0.2 sin(x + 2 y), where y runs along rows, or against them (sign -1)."""
    x = (torch.arange(SIDE) + 0.5) / SIDE * 2 * math.pi
    wave = 0.2 * (x + 2 * x[:, None]).cos()
    normal = torch.nn.functional.normalize(torch.stack([-wave, -2 * sign * wave, torch.ones_like(wave)], -1), dim=-1)
    return torch.einsum("hwk,sk->shw", normal, light).clamp_min(0)


def test_a_diffuse_surface_shows_its_cosine_and_the_way_of_its_rows():
    found = witness(bumps(LIGHT))
    theta, ratio = found.fall_off()
    assert theta == pytest.approx(math.radians(75)) and ratio == pytest.approx(math.cos(theta), rel=0.1)
    assert found.upright() > 0.9 and found.contradictions(True) == [] and len(found.contradictions(False)) == 1
    turned = witness(bumps(LIGHT, -1.0))
    assert turned.upright() < -0.9 and len(turned.contradictions(True)) == 1


def test_it_is_the_same_for_parts_of_any_size():
    assert witness(bumps(LIGHT), parts=7).upright() == pytest.approx(
        witness(bumps(LIGHT), parts=162).upright(), abs=1e-4
    )


@pytest.mark.parametrize("level", [0.0, 0.1, 3.0])
def test_a_flat_surface_with_noise_does_not_tell_the_way_of_its_rows(level):
    generator = torch.Generator().manual_seed(0)
    noise = torch.rand(len(LIGHT), SIDE, SIDE, generator=generator)
    found = witness(LIGHT[:, 2, None, None] * (1 + level * noise))
    assert abs(found.upright()) < CURL and found.contradictions(True) == []


def test_black_pictures_and_few_lights_tell_nothing():
    black = witness(torch.zeros(len(LIGHT), 1, 1))
    assert black.fall_off() is None and black.upright() == 0.0 and black.contradictions(False) == []
    near = LIGHT[:, 2] > math.cos(math.radians(40))
    inner = witness(bumps(LIGHT[near]), LIGHT[near], VIEW[near])
    assert inner.fall_off() is None
    single = witness(bumps(LIGHT[:1]), LIGHT[:1], VIEW[:1])
    assert single.fall_off() is None and single.upright() == 0.0
    oblique = VIEW[:, 2] < 0.9
    assert witness(bumps(LIGHT[oblique]), LIGHT[oblique], VIEW[oblique]).upright() == 0.0
