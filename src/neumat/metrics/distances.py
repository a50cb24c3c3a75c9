"""Distances between materials, as tables over blocks of one set.

A set metric needs the distances within and between sets, but not those between all materials of their union: each
distance takes a Comparison, which names the blocks that are wanted. What depends on one material only is computed once
for all of them. All tables are float64, and exactly symmetric where rows and columns are the same slice. A material
with a value that is not finite has distance NaN to every other, whatever its picture looks like.
"""

import functools
import math
from dataclasses import dataclass

import torch

from neumat.metrics.materials import MaterialSet, union
from neumat.metrics.ssim import ssim_tables

_PIXELS = 1 << 10  # picture values at a time
_COLUMNS, _TILE = 1 << 10, 120  # BRDF values and materials at a time: they fit a core's L2 cache
_ROUNDING = 1e-13  # of |x|^2 + |y|^2: below it a squared distance by matrix product is rounding, so 0


@dataclass(frozen=True)
class Comparison:
    """A MaterialSet and the blocks of it that are compared: a list of pairs of slices, (rows, columns)."""

    materials: MaterialSet
    blocks: list

    @functools.cached_property
    def squared_pixels(self):
        """Mean squared differences of the pictures in [0, 1], a table for each block, exact: shifted to -128..127, the
        sums of _PIXELS products are integers below 2^24, which float32 holds."""
        x = self.materials.images.flatten(1)
        norms = torch.zeros(len(x), dtype=torch.float64)
        products = [torch.zeros(len(x[a]), len(x[b]), dtype=torch.float64) for a, b in self.blocks]
        for part in x.split(_PIXELS, 1):
            part = part.float().sub_(128)
            norms += part.square().sum(1)
            for product, (a, b) in zip(products, self.blocks, strict=True):
                product += part[a] @ part[b].T
        scale = 255**2 * x.shape[1]
        pairs = zip(products, self.blocks, strict=True)
        return [(norms[a, None] + norms[b] - 2 * product) / scale for product, (a, b) in pairs]


def brdf_l1(comparison):
    """Mean |f - f'| over the metric entries and channels, 1/sr (M3ashy, equation 6)."""
    return _mean_absolute(comparison.materials.brdf, comparison.blocks)


def brdf_l1_log(comparison):
    """Mean |log(1 + f) - log(1 + f')| over the metric entries and channels (M3ashy, equation 35)."""
    return _mean_absolute(torch.log1p(comparison.materials.brdf), comparison.blocks)


def msl(comparison):
    """Mean of (log(1 + f cos theta_i) - log(1 + f' cos theta_i))^2 (M3ashy, equation 36)."""
    materials = comparison.materials
    x = torch.log1p(materials.brdf * materials.cos_light[:, None]).flatten(1).double()
    norms = torch.stack([row.dot(row) for row in x])
    tables = []
    for a, b in comparison.blocks:
        scale = norms[a, None] + norms[b]
        squared = scale - 2 * (x[a] @ x[b].T)
        tables.append(torch.where(squared > _ROUNDING * scale, squared, 0.0) / x.shape[1])
    return tables


def rmse(comparison):
    """Root mean square difference of the 8 bit pictures scaled to [0, 1], over pixels and channels. Exact: equal
    pictures have distance 0."""
    return [table.sqrt() for table in comparison.squared_pixels]


def neg_psnr(comparison):
    """Minus the PSNR in dB, peak 1, of the 8 bit pictures. Equal pictures get the finite value of an error of half a
    level in one channel of one pixel (-107.1 dB at 256 x 256), which is beyond any two that differ."""
    floor = (0.5 / 255) ** 2 / comparison.materials.images[0].numel()
    return [10 * torch.log10(table.clamp_min(floor)) for table in comparison.squared_pixels]


def neg_ssim(comparison):
    """Minus the mean SSIM of the pictures (see neumat.metrics.ssim for window and sampling)."""
    return [-table for table in ssim_tables(comparison.materials.images, comparison.blocks)]


DISTANCES = {
    "brdf_l1": brdf_l1,
    "brdf_l1_log": brdf_l1_log,
    "msl": msl,
    "rmse": rmse,
    "neg_psnr": neg_psnr,
    "neg_ssim": neg_ssim,
}


def distance_tables(name, comparison):
    """Return the tables of one registered distance, one for each block; NaN where either material is not finite."""
    finite, tables = comparison.materials.finite, []
    for table, (a, b) in zip(DISTANCES[name](comparison), comparison.blocks, strict=True):
        if a == b:
            table = (table + table.T) / 2
        tables.append(table.masked_fill(~(finite[a, None] & finite[b]), math.nan))
    return tables


def between(name, x, y):
    """Return the table (n, m) of one registered distance between two MaterialSets of n and m; see distance_tables."""
    n = len(x)
    (table,) = distance_tables(name, Comparison(union(x, y), [(slice(0, n), slice(n, None))]))
    return table


def _mean_absolute(values, blocks):
    x = values.flatten(1)
    return [(_sums(x[a]) if a == b else _sums_between(x[a], x[b])) / x.shape[1] for a, b in blocks]


def _sums(x):
    """Return the sums of |x - x'| of every two rows of x (n, d)."""
    n = len(x)
    table = torch.zeros(n, n, dtype=torch.float64)
    # Parts that fit the cache are several times as fast as whole rows.
    table[*torch.triu_indices(n, n, 1)] = sum(torch.pdist(part, p=1).double() for part in x.split(_COLUMNS, 1))
    return table + table.T


def _sums_between(x, y):
    """Return the sums of |x - y| of the rows of x with those of y.

    pdist's p = 1 kernel is so much faster than cdist's that it pays to leave half of its distances unused.
    """
    tiles = [[_sums(torch.cat([p, q]))[: len(p), len(p) :] for q in y.split(_TILE)] for p in x.split(_TILE)]
    return torch.cat([torch.cat(row, 1) for row in tiles])
