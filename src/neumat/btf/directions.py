"""Directions of light and view: those that BTFs are measured at, random ones, and the coordinates of models.

Directions are unit vectors (n, 3), float32, from the surface, in its frame (x, y, z = the normal of the mean plane).
"""

import math

import torch

# {name: (theta of the rings, directions in each, azimuth of the first of each)}, degrees.
UBO2014 = (
    (0, 11, 23.5, 30, 37.5, 45, 52.5, 60, 67.5, 75),
    (1, 6, 12, 12, 12, 18, 18, 24, 24, 24),
    (0, 15, 0, 15, 0, 0, 7.5, 0, 7.5, 0),
)
UBO2003 = ((0, 15, 30, 45, 60, 75), (1, 6, 12, 18, 20, 24), (0, 0, 0, 0, 0, 0))
LARGEST = math.radians(85)  # of random directions: models have to answer a little beyond the 75 degrees of UBO's


def spherical(theta, phi):
    """Return the directions (..., 3) at polar angles and azimuths (...), radians."""
    sin = torch.sin(theta)
    return torch.stack([sin * torch.cos(phi), sin * torch.sin(phi), torch.cos(theta)], -1)


def rings(thetas, counts, offsets=None):
    """Return the directions (n, 3) of rings: their polar angles, how many directions each has, and the azimuth of the
    first (None: 0 everywhere), degrees."""
    offsets = [0] * len(counts) if offsets is None else offsets
    theta = torch.tensor(thetas, dtype=torch.float64).repeat_interleave(torch.tensor(counts))
    phi = torch.cat([offset + 360 * torch.arange(n).double() / n for n, offset in zip(counts, offsets, strict=True)])
    return spherical(theta.deg2rad(), phi.deg2rad()).float()


def grid(views, lights):
    """Return light and view (v l, 3) of every light (l, 3) for every view (v, 3), view by view."""
    return lights.repeat(len(views), 1), views.repeat_interleave(len(lights), 0)


def ubo2014_directions():
    """Return the 151 directions (151, 3) of lights, and of views, of the UBO2014 database, ring by ring."""
    return rings(*UBO2014)


def ubo2003_directions():
    """Return the 81 directions (81, 3) of lights, and of views, of the UBO2003 and ATRIUM databases, ring by ring."""
    return rings(*UBO2003)


def concentric_square(direction):
    """Return the position (..., 2) in [0, 1]^2 of directions (..., 3) of the upper hemisphere.

    The concentric map (Shirley and Chiu 1997, A low distortion map between disk and square) of the disk whose radius is
    theta / (pi / 2): grazing angles keep their share of the square, which the disk of (x, y) squeezes to its rim. The
    normal lies at (1/2, 1/2); directions below the horizon go to the border.
    """
    x, y, z = direction.unbind(-1)
    radius = (torch.atan2(torch.hypot(x, y), z) * (2 / math.pi)).clamp_max(1.0)
    wide = x.abs() >= y.abs()
    longer, shorter = torch.where(wide, x, y), torch.where(wide, y, x)
    first = torch.where(longer < 0, -radius, radius)
    second = first * torch.atan(shorter / torch.where(longer == 0, 1.0, longer)) * (4 / math.pi)
    return torch.stack([torch.where(wide, first, second), torch.where(wide, second, first)], -1) / 2 + 0.5


def concentric_direction(square):
    """Return the directions (..., 3) at positions (..., 2) in [0, 1]^2: the inverse of `concentric_square`."""
    a, b = (2 * square - 1).unbind(-1)
    wide = a.abs() >= b.abs()
    first, second = torch.where(wide, a, b), torch.where(wide, b, a)
    turn = second / torch.where(first == 0, 1.0, first) * (math.pi / 4)
    theta = first * (math.pi / 2)
    along, across = torch.sin(theta) * torch.cos(turn), torch.sin(theta) * torch.sin(turn)
    return torch.stack([torch.where(wide, along, across), torch.where(wide, across, along), torch.cos(theta)], -1)


def random_directions(n, generator, largest=LARGEST):
    """Return n random directions (n, 3), even over the disk of radius theta up to `largest`, radians.

    Against an even spread over the sphere, grazing directions get a little more: their density is theta / sin(theta).
    """
    theta = torch.rand(n, generator=generator).sqrt() * largest
    return spherical(theta, torch.rand(n, generator=generator) * (2 * math.pi))


def random_pairs(n, generator, largest=LARGEST):
    """Return light and view, each (n, 3), drawn independently by `random_directions`."""
    return random_directions(n, generator, largest), random_directions(n, generator, largest)


def _half(light, view):
    """Return the half vector (n, 3); the normal where light and view cancel each other out."""
    total = light + view
    length = torch.linalg.vector_norm(total, dim=-1, keepdim=True)
    normal = torch.tensor([0.0, 0.0, 1.0], dtype=total.dtype, device=total.device)
    return torch.where(length > 1e-6, total / length.clamp_min(1e-6), normal)


def half_difference(light, view):
    """Return the half vector h and the difference vector d, each (n, 3), of light and view, each (n or 1, 3).

    d is the light turned by the smallest rotation that takes h to the normal. Rusinkiewicz's turns by the azimuth of h
    instead, so that d jumps where h passes the normal; this one has no seam, and d = light where h is the normal.
    """
    h = _half(light, view)
    hx, hy, hz = h.unbind(-1)
    x, y, z = light.expand_as(h).unbind(-1)
    # The rotation by Rodrigues' formula about h x n, whose denominator 1 + hz is above 1 in the upper hemisphere.
    side = (hx * x + hy * y) / (1 + hz).clamp_min(1e-6) + z
    return h, torch.stack([x - hx * side, y - hy * side, hx * x + hy * y + hz * z], -1)


def light_view(h, d):
    """Return light and view, each (n, 3), of half and difference vectors: the inverse of `half_difference`."""
    hx, hy, hz = h.unbind(-1)
    x, y, z = d.unbind(-1)
    side = z - (hx * x + hy * y) / (1 + hz).clamp_min(1e-6)
    light = torch.stack([x + hx * side, y + hy * side, hz * z - hx * x - hy * y], -1)
    return light, 2 * (light * h).sum(-1, keepdim=True) * h - light


def paper_half_difference(light, view):
    """Return theta_h, phi_h, theta_d, phi_d, each (n,), radians, of light and view, each (n or 1, 3).

    Rusinkiewicz 1998, A new change of variables for efficient BRDF representation: d is the light turned by -phi_h
    about the normal, then by -theta_h about y. Azimuths lie in [-pi, pi]; nothing is folded, since texels of a BTF are
    not reciprocal. Where h is the normal, phi_h is 0.
    """
    h = _half(light, view)
    hx, hy, hz = h.unbind(-1)
    x, y, z = light.expand_as(h).unbind(-1)
    sin_h = torch.hypot(hx, hy)
    tilted = sin_h > 1e-7
    cos_p = torch.where(tilted, hx / sin_h.clamp_min(1e-7), 1.0)
    sin_p = torch.where(tilted, hy / sin_h.clamp_min(1e-7), 0.0)
    along, across = cos_p * x + sin_p * y, cos_p * y - sin_p * x
    dx, dz = hz * along - sin_h * z, sin_h * along + hz * z
    return (
        torch.atan2(sin_h, hz),
        torch.atan2(sin_p * tilted, cos_p),
        torch.atan2(torch.hypot(dx, across), dz),
        torch.atan2(across, dx),
    )
