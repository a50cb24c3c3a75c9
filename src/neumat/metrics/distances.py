"""Distances between materials: every material of a set with every other, as one symmetric table.

A set metric needs the distances within and between two sets; both come from one table over their union, in which
each picture's statistics are taken once. All tables are float64 (n, n) and exactly symmetric. A material with a
value that is not finite has distance NaN to every other, whatever its picture looks like.
"""

import math

import torch

from neumat.metrics.ssim import pairwise_ssim

_PIXELS = 1 << 10  # picture values at a time
_COLUMNS = 1 << 10  # BRDF values at a time
_ROUNDING = 1e-13  # of |x|^2 + |y|^2: below it a squared distance by matrix product is rounding, so 0


def brdf_l1(materials):
    """Mean |f - f'| over the metric entries and channels, 1/sr (M3ashy, equation 6)."""
    return _mean_absolute(materials.brdf)


def brdf_l1_log(materials):
    """Mean |log(1 + f) - log(1 + f')| over the metric entries and channels (M3ashy, equation 35)."""
    return _mean_absolute(torch.log1p(materials.brdf))


def msl(materials):
    """Mean of (log(1 + f cos theta_i) - log(1 + f' cos theta_i))^2 (M3ashy, equation 36)."""
    x = torch.log1p(materials.brdf * materials.cos_light[:, None]).flatten(1).double()
    return _squared(x) / x.shape[1]


def rmse(materials):
    """Root mean square difference of the 8 bit pictures scaled to [0, 1], over pixels and channels. Exact: equal
    pictures have distance 0."""
    return _mean_squared_pixels(materials.images).sqrt()


def neg_psnr(materials):
    """Minus the PSNR in dB, peak 1, of the 8 bit pictures. Equal pictures get the finite value of an error of half a
    level in one channel of one pixel (-107.1 dB at 256 x 256), which is beyond any two that differ."""
    floor = (0.5 / 255) ** 2 / materials.images[0].numel()
    return 10 * torch.log10(_mean_squared_pixels(materials.images).clamp_min(floor))


def neg_ssim(materials):
    """Minus the mean SSIM of the pictures (see neumat.metrics.ssim for window and sampling)."""
    return -pairwise_ssim(materials.images)


DISTANCES = {
    "brdf_l1": brdf_l1,
    "brdf_l1_log": brdf_l1_log,
    "msl": msl,
    "rmse": rmse,
    "neg_psnr": neg_psnr,
    "neg_ssim": neg_ssim,
}


def distance_table(name, materials):
    """Return the table (n, n) of one registered distance over a MaterialSet of n; NaN where either is not finite."""
    finite = materials.finite
    table = DISTANCES[name](materials).double()
    return table.masked_fill(~(finite[:, None] & finite), math.nan)


def _mean_absolute(values):
    x = values.flatten(1)
    n = len(x)
    # pdist, not cdist: its p = 1 kernel is several times faster, all the more on parts that fit the cache.
    pairs = sum(torch.pdist(part.contiguous(), p=1).double() for part in x.split(_COLUMNS, 1))
    table = torch.zeros(n, n, dtype=torch.float64)
    table[*torch.triu_indices(n, n, 1)] = pairs / x.shape[1]
    return table + table.T


def _squared(x):
    """Squared Euclidean distances of the rows of float64 x (n, d) by one matrix product."""
    product = x @ x.T
    norms = product.diagonal()
    scale = norms[:, None] + norms
    squared = scale - (product + product.T)
    return torch.where(squared > _ROUNDING * scale, squared, 0.0).fill_diagonal_(0.0)


def _mean_squared_pixels(images):
    """Mean squared differences of pictures in [0, 1], exact: shifted to -128..127, the sums of _PIXELS products are
    integers below 2^24, which float32 holds."""
    x = images.flatten(1)
    total = sum(_gram(part) for part in x.split(_PIXELS, 1))
    norms = total.diagonal()
    return (norms[:, None] + norms - 2 * total) / (255**2 * x.shape[1])


def _gram(part):
    part = part.float() - 128
    return (part @ part.T).double()
