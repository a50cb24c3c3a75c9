"""Materials in other colours: their highlights stay what they are, their weights are solved for, not trained.

The body of a dielectric takes the wanted albedo: f' = max(f - d, 0) + min(f / d, 1) t / pi, where d = rho / pi is its
diffuse lobe, of albedo rho. A metal's colour is that of its highlight: f' = f t / a, where a is its albedo. Either is a
function of f alone, so f' is as reciprocal as f; `fields.validity` says whether it keeps energy. Before that, channels
are put into the order of the wanted colour, which is exact. log(1 + f') is no linear function of the last hidden layer,
as log(1 + f) is; the last layer is solved for by weighted least squares.
"""

import functools
import math

import numpy as np
import torch

from neumat.brdf.coordinates import above_horizon, cosines, grid_angles, half_difference
from neumat.fields.field import evaluate_inputs
from neumat.fields.layout import unpack
from neumat.generative.orders import ORDERS, reorder
from neumat.metrics.appearance import WHITE
from neumat.seeds import torch_generator

DIRECTIONS = 400  # of the grid's entries, which are dense in the highlight; as many by uniform angles
GRAZING = 0.05  # cosine, below which no direction is looked at
DARKEST = 1e-3  # albedo of a body, below which it has no shape to keep
FLOOR = 0.02  # of log(1 + f): errors count relative to that and this
RIDGE = 1e-6
BLOCK = 1 << 9  # fields at a time, for the memory that they take
LARGEST_GAIN = 30.0


def own_colours(appearance):
    """Return linear sRGB (n, 3), relative to white, of what a person would call the colour of materials: of a metal
    that of all it reflects, else that of its body. appearance: see `recoloured`."""
    metallic = appearance["metallic"].to_numpy(bool)[:, None]
    diffuse, albedo = (appearance[[f"{name}_{c}" for c in "rgb"]].to_numpy() for name in ("diffuse", "albedo"))
    return torch.tensor(np.where(metallic, albedo, diffuse) / WHITE, dtype=torch.float32)


def recoloured(weights, appearance, colours):
    """Return the fields (n, 675) in other colours.

    appearance: a DataFrame of the fields, see `neumat.metrics.appearance`; colours (n, 3): linear sRGB, relative to
    white, that the appearance of the results is to have.
    """
    metallic = torch.tensor(appearance["metallic"].to_numpy(bool))
    own = own_colours(appearance) * WHITE
    order = own.argsort(1).gather(1, colours.argsort(dim=1, stable=True).argsort(1))  # channel k is taken from order[k]
    number = (order[:, None] == ORDERS).all(2).int().argmax(1)
    whole = reorder(weights, number), colours * WHITE, own.gather(1, order), metallic
    parts = zip(*(each.split(BLOCK) for each in whole), strict=True)
    return torch.cat([_solved(part[0], _values(*part)) for part in parts])


def _values(weights, target, own, metallic):
    """Return f' (n, m, 3) of fields (n, 675) at `_directions`; target, own (n, 3): albedos; metallic (n,)."""
    f = evaluate_inputs(weights, _directions()[0])
    own = own.clamp_min(DARKEST)[:, None]
    body = own / math.pi
    dielectric = (f - body).clamp_min(0) + (f / body).clamp_max(1) * target[:, None] / math.pi
    return torch.where(metallic[:, None, None], f * (target[:, None] / own).clamp_max(LARGEST_GAIN), dielectric)


def _solved(weights, values):
    """Return fields like `weights` (n, 675) whose last layer is fitted to values (n, m, 3), 1/sr, at `_directions`."""
    result = weights.clone()
    (k1, b1), (k2, b2), _ = unpack(weights)
    kernel, bias = unpack(result)[-1]
    hidden = torch.relu(_directions()[1] @ k1 + b1[:, None])
    hidden = torch.relu(hidden @ k2 + b2[:, None])
    hidden = torch.cat([hidden, torch.ones_like(hidden[..., :1])], 2).double()
    wanted = values.double().log1p()
    for c in range(3):
        rows = hidden / (wanted[..., c : c + 1] + FLOOR)
        normal = rows.mT @ rows
        scale = normal.diagonal(dim1=1, dim2=2).mean(1)
        normal = normal + RIDGE * scale[:, None, None] * torch.eye(normal.shape[1], dtype=torch.float64)
        right = rows.mT @ (wanted[..., c] / (wanted[..., c] + FLOOR))[..., None]
        solution = torch.linalg.solve(normal, right)[..., 0].float()
        kernel[..., c], bias[..., c] = solution[:, :-1], solution[:, -1]
    return result


@functools.cache
def _directions():
    """Return the inputs (m, 6) of directions, and the same with every other one mirrored, as other programs may do."""
    generator = torch_generator(0, "recolouring")
    entries = above_horizon().nonzero()[:, 0]
    dense = entries[torch.randperm(len(entries), generator=generator)[:DIRECTIONS]]
    u = torch.rand(4 * DIRECTIONS, 3, generator=generator, dtype=torch.float64)
    angles = (u * torch.tensor([math.pi / 2, math.pi / 2, math.pi])).unbind(1)
    cos_i, cos_o = cosines(*angles)
    above = ((cos_i > GRAZING) & (cos_o > GRAZING)).nonzero()[:DIRECTIONS, 0]
    inputs = torch.cat([half_difference(*grid_angles(dense)), half_difference(*(a[above] for a in angles))]).float()
    mirrored = inputs.clone()
    mirrored[1::2, 3:5] *= -1
    return inputs, mirrored
