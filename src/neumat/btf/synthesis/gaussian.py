"""Planes mapped to Gaussian variables, so that blending keeps histograms, and tables that map them back.

After Heitz and Neyret (2018), levels of detail after Deliot and Heitz (2019).
"""

import torch

from neumat.btf.planes import blend, prefilter

RANGE = 4.5  # standard deviations that the tables cover on both sides
ENTRIES = 1024  # of a table, at most


class GaussianPlane:
    """A plane's `levels` of detail [(H, W, c), ..., (1, 1, c)], whose principal components are each mapped to a
    standard Gaussian by the rank of its values.

    usage: how often each texel (H, W) appears in the endless plane; the Gaussian counts texels so, and the tables map
    it back to the histogram in which all count alike. Each level is mapped by itself and has its own table; beyond the
    first, tables are means under the variance that bilinear fetches take away. All share the first one's components.

    decorrelate: map principal components in place of the channels.
    """

    def __init__(self, levels, usage, wrap, decorrelate=True):
        self.base, self.wrap = levels[0][0, 0], wrap
        self.low = torch.stack([level.amin((0, 1)) for level in levels])
        self.high = torch.stack([level.amax((0, 1)) for level in levels])
        levels = [level - self.base for level in levels]
        channels = len(self.base)
        self.axes = _principal_axes(levels[0]) if decorrelate else torch.eye(channels, device=usage.device)
        count = min(ENTRIES, max(8, usage.numel() // 8))
        self.levels, tables = [], []
        for level, counts in zip(levels, prefilter(usage[..., None]), strict=True):
            values = (level.reshape(-1, channels) @ self.axes.T).reshape(level.shape)
            gaussian, quantiles = gaussianise(values, counts[..., 0])
            table = _table(quantiles, count)
            tables.append(_smoothed(table, 1 - _fetched_variance(gaussian)) if self.levels else table)
            self.levels.append(gaussian)
        self.tables = torch.stack(tables).float()
        self.stored = [*self.levels, self.tables, self.axes, self.base, self.low, self.high]

    def blend(self, level, positions, weights, scale=None):
        """Return features (n, c) from sums of fetches at `positions` (n, k, 2) times `weights` (n, k), which with
        `scale` (n, c), a factor where given, keep the variance. Components that the exemplar has not together give
        features beyond its own, which are cut to its range: what decodes them knows no others."""
        gaussian = blend(self.levels[level], positions, weights, self.wrap)
        values = _looked_up(self.tables[level], gaussian if scale is None else gaussian * scale)
        features = self.base
        for k in range(len(self.base)):  # no product of matrices, whose rounding would depend on the batch
            features = features + values[:, k : k + 1] * self.axes[k]
        return features.clamp(self.low[level], self.high[level])


def gaussianise(plane, usage):
    """Return a `plane` (H, W, c) with each channel's values replaced by the standard Gaussian's of equal rank, and the
    sorted values (H W, c).

    usage: how often each texel (H, W) appears, which counts for the Gaussian's ranks. Equal values are ordered by the
    means of their surroundings, so that no noise is added.
    """
    surroundings = plane
    for axis in (0, 1):
        surroundings = sum(torch.roll(surroundings, shift, axis) for shift in range(-3, 4))
    order = surroundings.flatten(0, 1).argsort(0)
    values = plane.flatten(0, 1)
    quantiles, second = values.gather(0, order).sort(dim=0, stable=True)
    order = order.gather(0, second)
    share = (usage.flatten() / usage.sum())[order]
    gaussian = torch.special.ndtri((share.cumsum(0) - share / 2).clamp(1e-6, 1 - 1e-6)).float()
    return torch.empty_like(values).scatter_(0, order, gaussian).reshape(plane.shape), quantiles


def _table(quantiles, count):
    """Return the table (count, c), float64, from the Gaussian, at equal steps within RANGE, to sorted values (n, c)."""
    steps = torch.linspace(-RANGE, RANGE, count, dtype=torch.float64, device=quantiles.device)
    place = (torch.special.ndtr(steps) * len(quantiles) - 0.5).clamp(0, len(quantiles) - 1)
    lower = place.long().clamp_max(max(0, len(quantiles) - 2))
    upper = (lower + 1).clamp_max(len(quantiles) - 1)
    values = quantiles.double()
    return values[lower] + (place - lower)[:, None] * (values[upper] - values[lower])


def _fetched_variance(level):
    """Return the variances (c,) of bilinear fetches of a `level` (H, W, c) of mean 0 at random positions."""
    level = level.double()
    neighbours = level
    for axis in (0, 1):  # the mean of f^2 and (1 - f)^2 over a texel is 1/3, that of f (1 - f) 1/6
        neighbours = (neighbours.roll(1, axis) + 4 * neighbours + neighbours.roll(-1, axis)) / 6
    return (level * neighbours).mean((0, 1))


def _smoothed(table, variances):
    """Return the means of a `table` (entries, c) under Gaussians of `variances` (c,) about its entries."""
    count = len(table)
    padded = torch.cat([table[:1].expand(count // 2, -1), table, table[-1:].expand(count // 2, -1)])
    cycles = torch.fft.rfftfreq(len(padded), 2 * RANGE / (count - 1), dtype=torch.float64, device=table.device)
    kernel = torch.exp((2 * torch.pi * cycles).square()[:, None] * variances.clamp_min(0) / -2)
    return torch.fft.irfft(torch.fft.rfft(padded, dim=0) * kernel, len(padded), 0)[count // 2 : count // 2 + count]


def _looked_up(table, gaussian):
    """Return values (n, c) of a `table` (entries, c) at `gaussian` (n, c), linear between entries."""
    count, channels = table.shape
    x = ((gaussian + RANGE) * ((count - 1) / (2 * RANGE))).clamp(0, count - 1)
    first = x.long().clamp(0, count - 2)
    index = first * channels + torch.arange(channels, device=table.device)
    flat = table.reshape(-1)
    lower, upper = flat[index], flat[index + channels]
    return lower + (x - first) * (upper - lower)


def _principal_axes(plane):
    """Return the principal axes (c, c) of a plane's features, as rows."""
    rows = plane.flatten(0, 1).double()
    rows = rows - rows.mean(0)
    return torch.linalg.eigh(rows.T @ rows).eigenvectors.T.flip(0).float().contiguous()
