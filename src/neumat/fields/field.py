"""Evaluation of neural fields: many materials at many directions."""

import torch

from neumat.brdf.coordinates import cosines, half_difference
from neumat.fields.layout import WIDTHS, matrices, unpack

# Of log(1 + f) in renderers and shaders, where float32 ends at 88.7: what is infinite, times light that is 0, would be
# NaN in the picture.
LARGEST_LOG = 80.0
MATERIALS, POINTS = 16, 1 << 10  # a block: 16 x 21 x 1024 float32 stay in the second-level cache


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
    columns = torch.cat([inputs.T, torch.ones_like(inputs.T[:1])])
    out = torch.empty(len(weights), len(inputs), 3, dtype=weights.dtype)
    for part, materials in zip(out.split(MATERIALS), weights.split(MATERIALS), strict=True):
        layers = with_biases(materials, widths)
        for rows, block in zip(part.split(POINTS, 1), columns.split(POINTS, 1), strict=True):
            rows[:] = reflectance(layers, block).mT
    return out


def with_biases(weights, widths=WIDTHS):
    """Return the kernels of weights (n, size) that act on columns, [(n, out + 1, in + 1), ..., (n, 3, in + 1)].

    Inputs have a last row of ones, biases are its weights, and hidden layers pass it on: columns are faster than rows,
    and a layer takes one pass less.
    """
    layers = [matrix.mT.contiguous() for matrix in matrices(weights, widths)]
    for k, layer in enumerate(layers[:-1]):
        one = torch.eye(layer.shape[2], dtype=weights.dtype)[-1:].expand(len(weights), -1, -1)
        layers[k] = torch.cat([layer, one], 1)
    return layers


def reflectance(layers, columns):
    """Return f = max(exp(x) - 1, 0), (n, 3, m), 1/sr, of n fields (see `with_biases`) at shared `columns` (7, m)."""
    *hidden, last = layers
    for kernel in hidden:
        columns = (kernel @ columns).relu_()
    return (last @ columns).expm1_().clamp_min_(0)


def evaluate(weights, theta_h, theta_d, phi_d, widths=WIDTHS):
    """Return the reflectance (n, m, 3), 1/sr, of fields (n, size) at m directions; 0 below the horizon."""
    values = evaluate_inputs(weights, half_difference(theta_h, theta_d, phi_d).to(weights.dtype), widths)
    cos_i, cos_o = cosines(theta_h, theta_d, phi_d)
    below = (cos_i <= 0) | (cos_o <= 0)
    return values.masked_fill(below.unsqueeze(-1), 0)  # a product would leave NaN where the exponential overflows


def highlights(weights):
    """Return the height (n,), 1/sr, of the highlights of fields (n, 675): at theta_h = 0, theta_d = 0.5."""
    return evaluate(weights, torch.zeros(1), torch.full((1,), 0.5), torch.zeros(1)).mean((1, 2))


class Field:
    """A material made of one weight vector (size,)."""

    def __init__(self, weights, widths=WIDTHS):
        self.weights = torch.as_tensor(weights)[None]
        self.widths = widths

    def eval(self, theta_h, theta_d, phi_d):
        """Return the reflectance (n, 3), 1/sr."""
        return evaluate(self.weights, theta_h, theta_d, phi_d, self.widths)[0]
