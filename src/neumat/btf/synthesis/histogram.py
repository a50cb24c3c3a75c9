"""Histogram-preserving blending (Heitz and Neyret 2018; levels of detail as Deliot and Heitz 2019)."""

import torch

from neumat.btf.planes import blend, prefilter
from neumat.btf.synthesis.base import Synthesis
from neumat.btf.synthesis.triangles import Grid

RANGE = 4.5  # standard deviations that the tables cover on both sides
ENTRIES = 1024  # of a table, at most


class Histogram(Synthesis):
    """Three patches over each position, blended as Gaussian variables, so that the histogram is kept.

    Each channel is mapped to a standard Gaussian by the rank of its values; blending by weights w / |w| keeps that
    distribution; a table maps it back. A level of detail is a prefiltered Gaussian plane with its own table: the means
    of the first one under the variance that prefiltering took away. Weights are the barycentric ones to the power 3 and
    patches keep inside an exemplar that does not tile (Burley 2019).

    decorrelate: map principal components in place of the channels.
    """

    fetches = 3

    def __init__(self, plane, seed, tileable=False, decorrelate=True):
        super().__init__(plane, seed, tileable)
        self.base = plane[0, 0]
        plane = plane - self.base
        self.axes = _principal_axes(plane) if decorrelate else torch.eye(self.channels, device=plane.device)
        values = (plane.reshape(-1, self.channels) @ self.axes.T).reshape(plane.shape)
        gaussian, quantiles = gaussianise(values)
        self.levels = prefilter(gaussian)
        self.tables = _tables(quantiles, self.levels)
        self.stored = [*self.levels, self.tables, self.axes, self.base]
        self.grid = Grid(self.height, self.width, seed, tileable)

    def _features(self, cell, fraction, level):
        level = min(level, self.top)
        positions, weights = self.grid.patches(cell, fraction)
        weights = weights * weights * weights
        a, b, c = weights.unbind(1)
        weights = weights / (a * a + b * b + c * c).sqrt()[:, None]
        values = _looked_up(self.tables[level], blend(self.levels[level], positions, weights, self.tileable))
        features = self.base
        for k in range(self.channels):  # no product of matrices, whose rounding would depend on the batch
            features = features + values[:, k : k + 1] * self.axes[k]
        return features


def gaussianise(plane):
    """Return a `plane` (H, W, c) with each channel's values replaced by the standard Gaussian's of equal rank, and the
    sorted values (H W, c). Equal values are ordered by the means of their surroundings, so that no noise is added."""
    surroundings = plane
    for axis in (0, 1):
        surroundings = sum(torch.roll(surroundings, shift, axis) for shift in range(-3, 4))
    order = surroundings.flatten(0, 1).argsort(0)
    values = plane.flatten(0, 1)
    quantiles, second = values.gather(0, order).sort(dim=0, stable=True)
    order = order.gather(0, second)
    uniform = (torch.arange(len(values), dtype=torch.float64, device=plane.device) + 0.5) / len(values)
    ranks = torch.special.ndtri(uniform).float()[:, None].expand_as(values)
    return torch.empty_like(values).scatter_(0, order, ranks).reshape(plane.shape), quantiles


def _tables(quantiles, levels):
    """Return tables (levels, entries, c) from the Gaussian, at equal steps within RANGE, to sorted values (n, c)."""
    count = min(ENTRIES, max(8, len(quantiles) // 8))
    steps = torch.linspace(-RANGE, RANGE, count, dtype=torch.float64, device=quantiles.device)
    place = (torch.special.ndtr(steps) * len(quantiles) - 0.5).clamp(0, len(quantiles) - 1)
    lower = place.long().clamp_max(max(0, len(quantiles) - 2))
    upper = (lower + 1).clamp_max(len(quantiles) - 1)
    values = quantiles.double()
    first = values[lower] + (place - lower)[:, None] * (values[upper] - values[lower])
    tables = [first, *(_smoothed(first, 1 - _fetched_variance(level)) for level in levels[1:])]
    return torch.stack(tables).float()


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
