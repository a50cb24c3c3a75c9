"""The one fixed scene: a unit sphere before an orthographic camera, lit by a grey analytic environment.

World frame: x to the right, y up, z to the camera; the sphere's centre is the origin and every light is infinitely
far away. The lights are achromatic, so that a material with permuted colour channels has the permuted picture. They
are smooth, so that a fixed quadrature resolves them, and small enough for a mirror to show them as distinct shapes.
"""

from dataclasses import dataclass

import torch

RADIUS = 0.94  # of the sphere, as a share of half the frame
BACKGROUND = 0.03  # linear radiance behind the sphere: constant, so that pictures differ by the material only
EXPOSURE = 1.35
AMBIENT = 0.22  # radiance from all directions


@dataclass(frozen=True)
class Light:
    """A soft disc of light: direction (any length), angular radius in radians, radiance at its centre."""

    direction: tuple
    radius: float
    radiance: float


LIGHTS = (
    Light((-0.55, 0.65, 0.60), 0.36, 5.0),  # key, upper left
    Light((0.85, 0.25, 0.45), 0.30, 1.6),  # fill, right
    Light((0.25, 0.95, -0.20), 0.40, 2.0),  # top, slightly behind
    Light((-0.80, -0.10, -0.55), 0.35, 3.0),  # rim, behind left
    Light((0.20, -0.90, 0.40), 0.60, 0.45),  # bounce from below
)


def environment(directions, lights=LIGHTS):
    """Return the radiance (...) that arrives from unit `directions` (..., 3), of `lights` and AMBIENT."""
    total = torch.full_like(directions[..., 0], AMBIENT)
    for light in lights:
        axis = torch.nn.functional.normalize(directions.new_tensor(light.direction), dim=0)
        width = 1 - torch.cos(directions.new_tensor(light.radius))
        # The fourth power gives the lobe a flat top and a steep but smooth edge. Beyond 80 it adds nothing to
        # AMBIENT, but exp would come to denormal numbers, which are slow.
        total += light.radiance * torch.exp(-((1 - directions @ axis) / width).square_().square_().clamp_max_(80))
    return total


def to_srgb8(linear, exposure=EXPOSURE):
    """Return linear radiance (any shape) as 8-bit sRGB (IEC 61966-2-1): exposed, clipped to 0..1, rounded.

    What is not a number becomes black, infinity white.
    """
    x = (linear * exposure).nan_to_num_(0.0).clamp_(0, 1)
    curved = x.clamp_min(0.0031308).pow_(1 / 2.4).mul_(1.055).sub_(0.055)
    return torch.where(x <= 0.0031308, 12.92 * x, curved).mul_(255).round_().to(torch.uint8)


def to_linear(values):
    """Return the linear light of sRGB values in 0..1, any shape."""
    return torch.where(values > 0.04045, ((values + 0.055) / 1.055) ** 2.4, values / 12.92)
