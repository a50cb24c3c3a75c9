"""Whether samples are new, real, and near to materials that nobody has trained on.

Of MaterialSets, modulo the order of their channels (`brightest_first`); distances are BRDF-L1-log (mean absolute
difference of log(1 + f) over the entries and channels).
"""

import itertools
import math

import torch

from neumat.metrics.distances import between
from neumat.metrics.materials import MaterialSet

DISTANCE = "brdf_l1_log"
_LARGEST_GAIN, _HALVINGS = 16.0, 8  # gains are found to within 16^(2 / 2^8): 2 %
_BLOCK = 1 << 5  # materials at a time: their comparisons stay within some tens of MB
_ORDERS = torch.tensor(list(itertools.permutations(range(3))))


def brightest_first(materials):
    """Return the MaterialSet with the channels of each material sorted, that of the largest mean log(1 + f) first."""
    order = torch.log1p(materials.brdf).mean(1).argsort(dim=1, descending=True, stable=True)
    return MaterialSet(materials.entries, materials.brdf.gather(2, order[:, None].expand_as(materials.brdf)))


def coverage(held_out, samples, sizes):
    """Return (sizes, held-out), float64: the distance of each held-out material to the nearest of the first N samples,
    for each N of `sizes`; inf where none is finite. Held-out and samples: MaterialSets, brightest channel first."""
    table = between(DISTANCE, held_out, samples).nan_to_num(nan=math.inf)
    return torch.stack([table[:, :size].amin(1) for size in sizes])


def nearest(materials, others):
    """Return the distance (n,), float64, of each material to the nearest of `others`, inf where none is finite."""
    return between(DISTANCE, materials, others).nan_to_num(nan=math.inf).amin(1)


def nearest_other(materials):
    """Return the distance (n,), float64, of each material to the nearest one of the same set but itself."""
    table = between(DISTANCE, materials, materials).nan_to_num(nan=math.inf)
    return table.fill_diagonal_(math.inf).amin(1)


def nearest_tinted(materials, others):
    """Return (n,), as `nearest` does, after the best order of the channels and the best gain of each, 1/16 to 16.

    A material in another tint is at distance 0. The gain of two channels is found by bisection, where the slope of the
    distance over the logarithm of the gain changes its sign.
    """
    x, y = (materials.brdf.mT.contiguous(), others.brdf.mT.contiguous())  # (n, 3, e)
    found = []
    for block in x.split(_BLOCK):
        f, target = block[:, None, :, None], y[None, :, None]  # (b, 1, 3, 1, e), (1, m, 1, 3, e)
        low = torch.full((len(block), len(y), 3, 3, 1), -math.log(_LARGEST_GAIN))
        high = -low
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            scaled = middle.exp() * f
            slope = (torch.sign(scaled - target) * (1 - 1 / (1 + scaled))).sum(-1, keepdim=True)
            low, high = torch.where(slope < 0, middle, low), torch.where(slope < 0, high, middle)
        scaled = ((low + high) / 2).exp() * f
        table = (torch.log1p(scaled) - torch.log1p(target)).abs().mean(-1)  # (b, m, 3, 3)
        paired = table[:, :, torch.arange(3), _ORDERS].mean(-1)  # (b, m, 6)
        found.append(paired.amin((1, 2)).nan_to_num(nan=math.inf).double())
    return torch.cat(found)
