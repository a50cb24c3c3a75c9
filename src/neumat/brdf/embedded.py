"""The embedded 100: compact fields of the MERL materials, distilled by this project from the published NBRDFs.

Each is a 6-64-64-3 network with SiLU activations and half-precision weights, log(1 + f) as its output. Of the six
inputs hy, always 0, gives way to sqrt(2 theta_h / pi), the MERL grid's own axis, along which highlights are wide.
What it was made from, and how near it is, is in `data/embedded.md`.
"""

import functools
import math
from importlib.resources import files

import numpy as np
import torch
from safetensors.torch import load

from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles, half_difference

WIDTHS = (6, 64, 64, 3)
CHUNK = 1 << 11  # directions a block: its hidden layers stay in the cache


@functools.cache
def _data():
    """Return (names, [(kernel (100, in, out), bias (100, out)), ...]) as float32."""
    tensors = load(files("neumat.brdf").joinpath("data/embedded.safetensors").read_bytes())
    names = bytes(tensors.pop("names").tolist()).decode().split("\n")
    layers = len(WIDTHS) - 1
    return names, [(tensors[f"kernel{k}"].float(), tensors[f"bias{k}"].float()) for k in range(layers)]


def embedded_names():
    """Return the names of the embedded materials, sorted."""
    return list(_data()[0])


def encode(theta_h, theta_d, phi_d):
    """Return the inputs (n, 6): hx, sqrt(2 theta_h / pi), hz, dx, dy, dz."""
    inputs = half_difference(theta_h, theta_d, phi_d)
    inputs[..., 1] = torch.sqrt(theta_h * (2 / math.pi))
    return inputs.float()


def forward(layers, inputs):
    """Return log(1 + f), (..., m, 3), at inputs (..., m, 6): SiLU layers, linear last."""
    *hidden, (kernel, bias) = layers
    x = inputs
    for layer_kernel, layer_bias in hidden:
        x = torch.nn.functional.silu(x @ layer_kernel + layer_bias.unsqueeze(-2))
    return x @ kernel + bias.unsqueeze(-2)


class Embedded:
    """One embedded material by its index in `embedded_names()`."""

    def __init__(self, index):
        self.layers = [(kernel[index], bias[index]) for kernel, bias in _data()[1]]

    @torch.no_grad()
    def eval(self, theta_h, theta_d, phi_d):
        """Return the reflectance (n, 3), 1/sr, at least 0."""
        inputs = encode(theta_h, theta_d, phi_d)
        blocks = [forward(self.layers, block) for block in inputs.split(CHUNK)]
        return torch.expm1(torch.cat(blocks)).clamp_min(0)


def embedded_table(index):
    """Return the material on the MERL grid, (1458000, 3) float32 numpy, 1/sr; NaN below the horizon."""
    valid = torch.nonzero(above_horizon())[:, 0]
    table = np.full((ENTRIES, 3), math.nan, np.float32)
    table[valid.numpy()] = Embedded(index).eval(*grid_angles(valid)).numpy()
    return table
