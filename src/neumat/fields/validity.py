"""Which weight vectors are materials: finite, and no source of energy."""

import functools
import math

import torch

from neumat.brdf.coordinates import half_difference
from neumat.brdf.validity import albedo_quadrature
from neumat.fields.field import evaluate_inputs

ANGLES = (0.0, 30.0, 60.0)  # of the light, degrees; beyond, the measurements themselves are extrapolated
RESOLUTION = 64  # 0.3 % off in the albedo of measured materials; float32 inputs of 3 angles take 0.2 MB


@functools.cache
def _quadrature():
    """Return, per angle of ANGLES, the inputs (m, 6) float32 of a field and the weights (m,) float32."""
    parts = [albedo_quadrature(math.radians(angle), RESOLUTION) for angle in ANGLES]
    return [(half_difference(*angles), weight.float()) for *angles, weight in parts]


def valid_fields(weights):
    """Return the bool array (n,) of fields (n, 675) that are valid BRDFs.

    Their weights are finite, and they reflect at most all of the light from each of ANGLES in each channel.
    Reciprocity and values >= 0 hold for every field by construction.
    """
    valid = torch.isfinite(weights).all(1)
    for inputs, quadrature in _quadrature():
        albedo = torch.einsum("nmc,m->nc", evaluate_inputs(weights, inputs), quadrature)
        valid &= (albedo <= 1).all(1)  # false for NaN
    return valid.numpy()
