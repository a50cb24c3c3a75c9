"""The order of a material's colour channels, told apart from the material.

A material is as likely in any order of its channels: AugMERL holds it in all six. A model that knows it in one order
only, its brightest channel first, has a sixth of that to learn, and finds the other five by permuting its samples.
"""

import torch
from torch import nn

from neumat.augment.permutations import PERMUTATIONS, channel_order
from neumat.brdf.coordinates import half_difference
from neumat.fields.field import log_reflectance
from neumat.fields.layout import permutation_indices
from neumat.generative.denoisers import LEVEL_WIDTH

ORDERS = torch.tensor([channel_order(permutation) for permutation in PERMUTATIONS])  # (6, 3)
INDICES = torch.stack([permutation_indices(permutation) for permutation in PERMUTATIONS])  # (6, 675)
THETA_H, THETA_D = (0.0, 10.0, 50.0), 20.0  # degrees, where colours are read: highlight, its flank, body
FLOOR = 1e-3  # 1/sr: differences far below it are rounding


@torch.no_grad()
def colours(weights):
    """Return the logarithms of reflectance (n, 3 channels, directions) of fields (n, 675); finite for any weights."""
    theta_h = torch.deg2rad(torch.tensor(THETA_H))
    inputs = half_difference(theta_h, torch.deg2rad(torch.full_like(theta_h, THETA_D)), torch.zeros_like(theta_h))
    values = log_reflectance(weights.float(), inputs.float()).nan_to_num().clamp(0, 80).expm1()
    return (values + FLOOR).log().mT


def brightest_first(weights):
    """Return (the fields (n, 675), brightest channel first by its mean colour, the orders (n,) that put back)."""
    channels = colours(weights).mean(2).argsort(dim=1, descending=True, stable=True)
    return reorder(weights, _number(channels)), _number(channels.argsort(1))


def distinct(weights):
    """Return (the different fields (m, 675) among `weights` (n, 675), brightest channel first, the position (n,) of
    each of the n among them, its order (n,)): `reorder(fields[position], order)` gives `weights` again."""
    fields, orders = brightest_first(weights)
    fields, positions = fields.unique(dim=0, return_inverse=True)
    return fields, positions, orders


def reorder(weights, orders):
    """Return the fields (n, 675) with their channels in `orders` (n,), positions in ORDERS: exact, no refit."""
    return weights.gather(1, INDICES[orders])


def _number(channels):
    """Return the positions (n,) in ORDERS of channels (n, 3)."""
    return (channels[:, None] == ORDERS).all(2).int().argmax(1)


class OrderOfRequest(nn.Module):
    """How well each order of a material's channels answers to a request, as logits (n, 6), in the order of ORDERS.

    The dot product of what the colours in that order are taken for and of the embedded request: it depends on the
    material in that order alone, so what red means is learnt once, from all materials.
    """

    def __init__(self, request):
        super().__init__()
        self.request = request  # a module: ({modality: (n, size)}, present (n, modalities)) -> (n, LEVEL_WIDTH)
        size = 3 * len(THETA_H)
        self.seen = nn.Sequential(nn.Linear(size, LEVEL_WIDTH), nn.SiLU(), nn.Linear(LEVEL_WIDTH, LEVEL_WIDTH))

    def forward(self, colours, asked, present):
        seen = self.seen(colours[:, ORDERS.to(colours.device)].flatten(2))
        logits = (seen * self.request(asked, present)[:, None]).sum(2)
        return logits * present.amax(1, keepdim=True)  # without a request all are alike
