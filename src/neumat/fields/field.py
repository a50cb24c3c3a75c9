"""Evaluation of neural fields: many materials at many directions."""

import torch

from neumat.brdf.coordinates import cosines, half_difference
from neumat.fields.layout import WIDTHS, unpack

CHUNK = 1 << 12  # points a block: 4096 x 21 float32 stay in the second-level cache


def log_reflectance(weights, inputs, widths=WIDTHS):
    """Return log(1 + f) before clamping, (..., m, 3), of weights (..., size) at inputs (..., m, 6).

    ReLU hidden layers, linear last layer (Sztrajman et al. 2021, section 3.1).
    """
    *hidden, (kernel, bias) = unpack(weights, widths)
    x = inputs
    for layer_kernel, layer_bias in hidden:
        x = torch.relu(x @ layer_kernel + layer_bias.unsqueeze(-2))
    return x @ kernel + bias.unsqueeze(-2)


@torch.no_grad()
def evaluate_inputs(weights, inputs, widths=WIDTHS):
    """Return f = max(exp(x) - 1, 0), (n, m, 3), 1/sr, of weights (n, size) at shared inputs (m, 6)."""
    out = torch.empty(len(weights), len(inputs), 3, dtype=weights.dtype)
    for start in range(0, len(inputs), CHUNK):
        block = inputs[start : start + CHUNK]
        for i in range(len(weights)):
            out[i, start : start + CHUNK] = torch.expm1(log_reflectance(weights[i], block, widths)).clamp_min(0)
    return out


def evaluate(weights, theta_h, theta_d, phi_d, widths=WIDTHS):
    """Return the reflectance (n, m, 3), 1/sr, of fields (n, size) at m directions; 0 below the horizon."""
    values = evaluate_inputs(weights, half_difference(theta_h, theta_d, phi_d).to(weights.dtype), widths)
    cos_i, cos_o = cosines(theta_h, theta_d, phi_d)
    return values * ((cos_i > 0) & (cos_o > 0)).unsqueeze(-1)


class Field:
    """A material made of one weight vector (size,)."""

    def __init__(self, weights, widths=WIDTHS):
        self.weights = torch.as_tensor(weights)[None]
        self.widths = widths

    def eval(self, theta_h, theta_d, phi_d):
        """Return the reflectance (n, 3), 1/sr."""
        return evaluate(self.weights, theta_h, theta_d, phi_d, self.widths)[0]
