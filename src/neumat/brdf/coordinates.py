"""Rusinkiewicz coordinates on the MERL grid.

Frames as in Sztrajman et al. 2021: the half vector has azimuth 0, h = (sin theta_h, 0, cos theta_h); the
difference vector d is the incident direction in the frame of h (Rusinkiewicz 1998). Angles in radians. Swapping
light and view adds pi to phi_d, so phi_d is taken modulo pi: everything evaluated through here is reciprocal.
"""

import functools
import math

import torch

GRID = (90, 90, 180)  # theta_h, theta_d, phi_d
ENTRIES = math.prod(GRID)


def canonical_phi_d(phi_d):
    """Return phi_d in [0, pi)."""
    return torch.remainder(phi_d, math.pi)


def grid_axes():
    """Return the angles of the MERL grid: theta_h (90,) with its square-root axis, theta_d (90,), phi_d (180,)."""
    n_h, n_d, n_p = GRID
    theta_h = (torch.arange(n_h, dtype=torch.float64) / n_h) ** 2 * (math.pi / 2)
    theta_d = torch.arange(n_d, dtype=torch.float64) / n_d * (math.pi / 2)
    phi_d = torch.arange(n_p, dtype=torch.float64) / n_p * math.pi
    return theta_h, theta_d, phi_d


def grid_angles(indices):
    """Return (theta_h, theta_d, phi_d), float32, of flat table indices phi_d + 180 (theta_d + 90 theta_h)."""
    theta_h, theta_d, phi_d = grid_axes()
    _, n_d, n_p = GRID
    indices = torch.as_tensor(indices)
    return (
        theta_h[indices // (n_d * n_p)].float(),
        theta_d[indices // n_p % n_d].float(),
        phi_d[indices % n_p].float(),
    )


def half_difference(theta_h, theta_d, phi_d):
    """Return the Cartesian half and difference vectors, shape (..., 6): (hx, hy, hz, dx, dy, dz)."""
    phi_d = canonical_phi_d(phi_d)
    sin_d = torch.sin(theta_d)
    return torch.stack(
        [
            torch.sin(theta_h),
            torch.zeros_like(theta_h),
            torch.cos(theta_h),
            sin_d * torch.cos(phi_d),
            sin_d * torch.sin(phi_d),
            torch.cos(theta_d),
        ],
        dim=-1,
    )


def directions(theta_h, theta_d, phi_d):
    """Return the unit directions of light and view, each (..., 3), in the frame of the surface (normal = z)."""
    d = torch.stack(
        [torch.sin(theta_d) * torch.cos(phi_d), torch.sin(theta_d) * torch.sin(phi_d), torch.cos(theta_d)], dim=-1
    )
    sin_h, cos_h = torch.sin(theta_h), torch.cos(theta_h)
    wi = torch.stack([cos_h * d[..., 0] + sin_h * d[..., 2], d[..., 1], cos_h * d[..., 2] - sin_h * d[..., 0]], dim=-1)
    h = torch.stack([sin_h, torch.zeros_like(sin_h), cos_h], dim=-1)
    wo = 2 * (wi * h).sum(-1, keepdim=True) * h - wi
    return wi, wo


def rusinkiewicz(wi, wo):
    """Return (theta_h, theta_d, phi_d) of unit directions (..., 3); phi_d in [0, pi)."""
    h = torch.nn.functional.normalize(wi + wo, dim=-1)
    sin_h = torch.linalg.vector_norm(h[..., :2], dim=-1)
    theta_h = torch.atan2(sin_h, h[..., 2])
    # Rotate wi about z by -phi_h, then about y by -theta_h. Where h is the normal, phi_h is taken as 0.
    safe = sin_h > 1e-7
    cos_p = torch.where(safe, h[..., 0] / sin_h.clamp_min(1e-7), torch.ones_like(sin_h))
    sin_p = torch.where(safe, h[..., 1] / sin_h.clamp_min(1e-7), torch.zeros_like(sin_h))
    x = cos_p * wi[..., 0] + sin_p * wi[..., 1]
    y = cos_p * wi[..., 1] - sin_p * wi[..., 0]
    dx = h[..., 2] * x - sin_h * wi[..., 2]
    dz = sin_h * x + h[..., 2] * wi[..., 2]
    theta_d = torch.atan2(torch.hypot(dx, y), dz)
    return theta_h, theta_d, canonical_phi_d(torch.atan2(y, dx))


def cosines(theta_h, theta_d, phi_d):
    """Return (cos theta_i, cos theta_o), the cosines of light and view with the normal."""
    along = torch.cos(theta_h) * torch.cos(theta_d)
    across = torch.sin(theta_h) * torch.sin(theta_d) * torch.cos(phi_d)
    return along - across, along + across


@functools.cache
def above_horizon():
    """Return the flat bool mask (1458000,) of grid entries whose light and view both lie above the horizon: 76.2 %.

    All callers share it, so none may write into it.
    """
    theta_h, theta_d, phi_d = torch.meshgrid(*grid_axes(), indexing="ij")
    cos_i, cos_o = cosines(theta_h, theta_d, phi_d)
    return ((cos_i > 1e-6) & (cos_o > 1e-6)).flatten()
