import math

import pytest
import torch

from neumat.render import scene


def test_srgb_of_known_values():
    # 18 % grey is 118, 50 % is 188 (IEC 61966-2-1); out of range is clipped, broken is black or white.
    linear = torch.tensor([0.0, 0.18, 0.5, 1.0, 7.0, -1.0, math.nan, math.inf])
    assert scene.to_srgb8(linear, exposure=1.0).tolist() == [0, 118, 188, 255, 255, 0, 0, 255]


def test_srgb_exposure_scales_the_radiance():
    assert torch.equal(scene.to_srgb8(torch.tensor([0.2]), 2.0), scene.to_srgb8(torch.tensor([0.4]), 1.0))


@pytest.mark.parametrize("light", scene.LIGHTS)
def test_each_light_is_bright_at_its_centre_only(light):
    axis = torch.nn.functional.normalize(torch.tensor(light.direction, dtype=torch.float64), dim=0)
    side = torch.linalg.cross(axis, torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64))
    side = torch.nn.functional.normalize(side, dim=0)
    angle = 2 * light.radius
    there = axis * math.cos(angle) + side * math.sin(angle)
    assert scene.environment(axis) >= scene.AMBIENT + light.radiance
    assert scene.environment(axis) - scene.environment(there) > 0.5 * light.radiance
