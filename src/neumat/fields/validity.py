"""Which weight vectors are materials: a field can hold any function of directions, a BRDF can't."""

import math

import torch

from neumat.brdf.coordinates import half_difference
from neumat.brdf.validity import albedo_nodes
from neumat.fields.field import evaluate_inputs
from neumat.fields.mirrored import SERVED, unfolded_error

POLAR, AZIMUTHS = 64, 16  # of the quadrature: the widths of highlights need the first, the horizon the second
ANGLES = tuple(
    math.radians(angle) for angle in (5, 45, 70, 80, 85)
)  # of the light; guided samples break first at grazing angles
PEAK_ANGLES = 64  # theta_d from 0 to 80 degrees, at which the peak is looked for
# Of the fields fitted to the 100 MERL materials and their blends, the darkest reflects .019 at 80 degrees, the
# brightest .62, and .84 at 85 degrees; the highest peak is 3766 / sr.
LEAST_ALBEDO = 0.002  # of the brightest channel and angle: below it a material is black everywhere
LARGEST_ALBEDO = 1.0  # conservation of energy
LARGEST_PEAK = 1e4  # 1/sr


def valid(weights):
    """Return whether each of the fields (n, 675) can be served: bool (n,).

    That is: it is `physical`, and in programs that do not fold phi_d its brightness is off by at most SERVED.
    """
    result = physical(weights)
    result[result.clone()] = unfolded_error(weights[result]) <= SERVED
    return result


@torch.no_grad()
def physical(weights):
    """Return whether each of the fields (n, 675) is a BRDF: bool (n,).

    That is: all weights and values finite, not black everywhere, a peak of at most LARGEST_PEAK, and no more light
    reflected than received, in any channel and at any of ANGLES.
    """
    albedo = directional_albedos(weights, ANGLES).flatten(1)
    # What is not a number fails every comparison.
    bounded = (albedo <= LARGEST_ALBEDO).all(1) & (peaks(weights) <= LARGEST_PEAK)
    return torch.isfinite(weights).all(1) & bounded & (albedo.amax(1) >= LEAST_ALBEDO)


def directional_albedos(weights, angles):
    """Return the shares (n, angles, 3), float32, of light from the polar angles (radians) that fields (n, 675)
    reflect: see neumat.brdf.validity.directional_albedo."""
    nodes = [albedo_nodes(angle, POLAR, AZIMUTHS) for angle in angles]
    inputs = torch.cat([half_difference(*angles) for *angles, _ in nodes]).to(weights.dtype)
    values = evaluate_inputs(weights, inputs).split([len(weight) for *_, weight in nodes], 1)
    return torch.stack([weight.to(f.dtype) @ f for f, (*_, weight) in zip(values, nodes, strict=True)], 1)


def peaks(weights):
    """Return the largest f (n,), 1/sr, of fields (n, 675) in the mirror direction, over light up to 80 degrees."""
    theta_d = torch.linspace(0, math.radians(80), PEAK_ANGLES)
    theta_h = torch.zeros_like(theta_d)
    inputs = half_difference(theta_h, theta_d, torch.full_like(theta_d, math.pi / 2)).to(weights.dtype)
    return evaluate_inputs(weights, inputs).flatten(1).amax(1)
