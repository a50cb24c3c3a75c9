"""Directions of light at which a BRDF is evaluated: a fixed quadrature of the hemisphere, good from matte to mirror.

Frame: the normal is z and the view lies in the xz-plane, view = (sin theta_o, 0, cos theta_o). Angles in radians.
"""

import math

import torch

# Nodes per strategy: None is the cosine lobe, a number the roughness of a GGX lobe about the mirror direction.
STRATEGIES = {None: 610, 0.2: 233, 0.05: 144, 0.01: 89, 0.003: 55}


def fibonacci_lattice(count):
    """Return the lattice (count, 2) in the unit square; `count` is a Fibonacci number, for which it is even."""
    before, last = 1, 1
    while last < count:
        before, last = last, before + last
    i = torch.arange(count, dtype=torch.float64)
    return torch.stack([(i + 0.5) / count, i * before / count % 1], -1)


def cosine_lobe(u):
    """Return directions (n, 3) about z of density cos(theta) / pi, from points u (n, 2) of the unit square."""
    radius, azimuth = u[:, 0].sqrt(), 2 * math.pi * u[:, 1]
    return torch.stack([radius * azimuth.cos(), radius * azimuth.sin(), (1 - u[:, 0]).sqrt()], -1)


def ggx_lobe(u, view, alpha):
    """Return the mirror directions (rings, n, 3) of `view` (rings, 3) at visible GGX normals, from u (n, 2).

    A spherical cap, shifted by the view, in the frame where the distribution is a hemisphere (Dupuy and Benyoub
    2023, Sampling Visible GGX Normals with Spherical Caps).
    """
    stretch = view.new_tensor([alpha, alpha, 1.0])
    standard = torch.nn.functional.normalize(view * stretch, dim=-1)[:, None]
    azimuth = (2 * math.pi * u[:, 1]).expand(len(view), -1)
    z = (1 - u[:, 0]) * (1 + standard[..., 2]) - standard[..., 2]
    sine = (1 - z**2).clamp_min(0).sqrt()
    cap = torch.stack([sine * azimuth.cos(), sine * azimuth.sin(), z], -1)
    h = torch.nn.functional.normalize((cap + standard) * stretch, dim=-1)
    view = view[:, None]
    return 2 * (view * h).sum(-1, keepdim=True) * h - view


def ggx_density(light, view, alpha):
    """Return the density (rings, n), 1/sr, with which `ggx_lobe` gives the directions `light` (rings, n, 3)."""
    h = torch.nn.functional.normalize(light + view[:, None], dim=-1)
    # From the sine of theta_h: 1 - cos^2 would lose all digits of the sharp lobes.
    sine2 = h[..., 0] ** 2 + h[..., 1] ** 2
    normals = alpha**2 / (math.pi * (sine2 + alpha**2 * h[..., 2] ** 2) ** 2)
    sine, cosine = view[:, :1], view[:, 2:]
    return normals / (2 * (cosine + (cosine**2 + (alpha * sine) ** 2).sqrt()))


def hemisphere(theta_o, strategies=STRATEGIES):
    """Return light (rings, nodes, 3), view (rings, 3) and weight (rings, nodes) for view angles theta_o (rings,).

    The integral of f cos(theta_i) over the hemisphere is the sum of weight * f. The nodes of all strategies are
    weighted by the balance heuristic (Veach 1997, equation 9.8); those below the horizon weigh 0.
    """
    view = torch.stack([theta_o.sin(), torch.zeros_like(theta_o), theta_o.cos()], -1)
    lobes = [
        cosine_lobe(fibonacci_lattice(count)).expand(len(view), -1, -1)
        if alpha is None
        else ggx_lobe(fibonacci_lattice(count), view, alpha)
        for alpha, count in strategies.items()
    ]
    light = torch.cat(lobes, dim=1)
    cosine = light[..., 2]
    density = sum(
        count * (cosine / math.pi if alpha is None else ggx_density(light, view, alpha))
        for alpha, count in strategies.items()
    )
    return light, view, torch.where(cosine > 0, cosine / density, 0.0)
