"""Physical plausibility of a material. Reciprocity needs no check: the coordinates enforce it."""

import math

import torch

from neumat.brdf.coordinates import rusinkiewicz


def directional_albedo(material, theta_i, resolution=256):
    """Return the share (3,), float64, of light from the polar angle `theta_i` that the material reflects.

    Above 1 the material creates energy.
    """
    theta_h, theta_d, phi_d, weight = albedo_nodes(theta_i, resolution, resolution)
    values = material.eval(theta_h.float(), theta_d.float(), phi_d.float())
    return (values.double() * weight[:, None]).sum(0)


def albedo_nodes(theta_i, polar, azimuths):
    """Return theta_h, theta_d, phi_d and weight, each (m,) float64, with m at most polar * azimuths: the sum of
    weight * f is the directional albedo at `theta_i`.

    Midpoint quadrature over half vectors, whose square-root spacing in theta_h puts the points where highlights are:
    dw_o = 4 (w_i . h) dh (Walter et al. 2007, eq. 14).
    """
    u = (torch.arange(polar, dtype=torch.float64) + 0.5) / polar
    v = (torch.arange(azimuths, dtype=torch.float64) + 0.5) / azimuths
    theta_h, phi_h = u**2 * (math.pi / 2), v * math.pi  # the other half of phi_h is its mirror image
    theta_h, phi_h = (grid.flatten() for grid in torch.meshgrid(theta_h, phi_h, indexing="ij"))
    sin_h = torch.sin(theta_h)
    h = torch.stack([sin_h * torch.cos(phi_h), sin_h * torch.sin(phi_h), torch.cos(theta_h)], dim=-1)
    wi = torch.tensor([math.sin(theta_i), 0.0, math.cos(theta_i)], dtype=torch.float64).expand_as(h)
    cos_d = (wi * h).sum(-1, keepdim=True)
    wo = 2 * cos_d * h - wi
    # dh = sin(theta_h) dtheta_h dphi_h, and dtheta_h = sqrt(2 pi theta_h) du; twice for the mirror image.
    dh = sin_h * torch.sqrt(2 * math.pi * theta_h) * (2 * math.pi / (polar * azimuths))
    weight = 4 * cos_d[:, 0] * wo[:, 2] * dh
    reached = (cos_d[:, 0] > 0) & (wo[:, 2] > 0)
    return *rusinkiewicz(wi[reached], wo[reached]), weight[reached]
