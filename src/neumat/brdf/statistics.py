"""Statistics of reflectance over the valid entries of the MERL grid: all that the rules of `neumat.brdf.categories`
and Figs. 23 to 25 of M3ashy need, gathered block by block.

Only the means and maxima per channel depend on the order of the colour channels.
"""

import math

import numpy as np
import pandas as pd
import torch

from neumat.brdf.coordinates import GRID, above_horizon, cosines, grid_angles, grid_axes
from neumat.errors import NeumatError

F_DIFFUSE = 1 / math.pi  # 1/sr; a constant BRDF above it reflects more light than it gets (M3ashy, equation 8)
GRAZING = math.radians(80)  # beyond it the MERL data are extrapolated
# Entries with theta_d = phi_d = 0, one for each theta_h: light and view coincide and lie above the horizon.
LINE = torch.arange(GRID[0]) * GRID[1] * GRID[2]
CHANNELS = ("mean_r", "mean_g", "mean_b", "maximum_r", "maximum_g", "maximum_b")
COUNTS = ("entries", "exceeding", "inner_entries", "inner_exceeding")
BLOCK = 1 << 14  # entries of one material at a time


class Extremes:
    """What n materials reach, updated with their values block by block."""

    def __init__(self, n, f_diffuse):
        self.f_diffuse = f_diffuse
        self.entries = 0
        self.exceeding = torch.zeros(n, dtype=torch.int64)
        self.minimum = torch.full((n,), torch.inf)
        self.difference = torch.zeros(n)
        self.relative_difference = torch.zeros(n)
        self.sum = torch.zeros(n, 3, dtype=torch.float64)
        self.channel_maximum = torch.zeros(n, 3)

    def add(self, values):
        """Add values (n, 3, m) float32, 1/sr, at m more entries."""
        r, g, b = values.unbind(1)
        largest = torch.maximum(torch.maximum(r, g), b)
        above = largest > self.f_diffuse
        spread = (largest - torch.minimum(torch.minimum(r, g), b)).mul_(above)
        self.entries += values.shape[2]
        self.exceeding = self.exceeding + above.sum(1)  # not in place: `statistics` keeps the earlier one
        self.minimum = torch.minimum(self.minimum, largest.amin(1))
        self.difference = torch.maximum(self.difference, spread.amax(1))
        self.relative_difference = torch.maximum(self.relative_difference, spread.div_(largest + 1e-30).amax(1))
        self.sum += values.sum(2)
        self.channel_maximum = torch.maximum(self.channel_maximum, values.amax(2))

    def columns(self):
        """Return {name: (n,) tensor}; see `statistics`."""
        return {
            "entries": torch.full_like(self.exceeding, self.entries),
            "exceeding": self.exceeding,
            "minimum": self.minimum,
            "maximum": self.channel_maximum.amax(1),
            "difference": self.difference,
            "relative_difference": self.relative_difference,
        }


def statistics(n, inner, grazing, line, f_diffuse=F_DIFFUSE):
    """Return the statistics of n materials, a DataFrame of n rows.

    inner, grazing: iterables of values (n, 3, m) float32, 1/sr, which together hold every valid entry once; in
    `grazing` light or view is more than 80 degrees from the normal. line: values (n, 3, 90) at LINE. f_diffuse: 1/sr.

    entries: how many; exceeding: those where the largest channel is above f_diffuse. minimum, maximum: of the largest
    channel. difference: the largest of two channels of an exceeding entry; relative_difference: in shares of that
    entry's largest channel; both 0 where none exceeds. The same with the prefix inner_: without the grazing entries.
    mean_r, ..., maximum_b: per channel. peak: the largest channel at theta_h = theta_d = phi_d = 0; half_width: see
    the function. In 1/sr but for counts, shares and the width (radians). A value that is not finite leaves a mean that
    is not finite.
    """
    extremes = Extremes(n, f_diffuse)
    for values in inner:
        extremes.add(values)
    within = {f"inner_{name}": column for name, column in extremes.columns().items()}
    for values in grazing:
        extremes.add(values)
    per_channel = torch.cat([extremes.sum / extremes.entries, extremes.channel_maximum], 1)
    line = line.amax(1)
    columns = {
        **extremes.columns(),
        **within,
        **dict(zip(CHANNELS, per_channel.unbind(1), strict=True)),
        "peak": line[:, 0],
        "half_width": half_width(line),
    }
    return pd.DataFrame({name: column.numpy() for name, column in columns.items()})


def half_width(line):
    """Return the theta_h (n,), radians, at which line (n, 90) first falls to half of its value at theta_h = 0.

    line: reflectance at theta_d = phi_d = 0 on the grid's theta_h. Linear between entries; pi / 2 where it never falls
    so far.
    """
    theta_h = grid_axes()[0].to(line.dtype)
    half = line[:, :1] / 2
    below = line <= half
    falls = below.any(1) & (line[:, 0] > 0)
    k = below.int().argmax(1, keepdim=True).clamp_min(1)
    before, after = line.gather(1, k - 1), line.gather(1, k)
    share = (before - half) / (before - after).clamp_min(1e-30)
    width = torch.lerp(theta_h[k - 1], theta_h[k], share)[:, 0]
    return torch.where(falls, width, math.pi / 2)


def split(entries):
    """Return (inner, grazing), the positions within flat grid indices `entries` (m,) of both kinds of entries."""
    cos_i, cos_o = cosines(*grid_angles(entries))
    inner = torch.minimum(cos_i, cos_o) >= math.cos(GRAZING)
    return inner.nonzero()[:, 0], (~inner).nonzero()[:, 0]


def valid_entries():
    """Return the flat indices of the grid's entries above the horizon, int64."""
    return above_horizon().nonzero()[:, 0]


def material_statistics(material, f_diffuse=F_DIFFUSE):
    """Return the `statistics`, one row, of anything with `eval(theta_h, theta_d, phi_d) -> (m, 3)`."""
    entries = valid_entries()
    inner, grazing = (
        (material.eval(*grid_angles(part)).float().T[None] for part in entries[positions].split(BLOCK))
        for positions in split(entries)
    )
    return statistics(1, inner, grazing, material.eval(*grid_angles(LINE)).float().T[None], f_diffuse)


def source_statistics(sources, f_diffuse=F_DIFFUSE, progress=iter):
    """Return the `statistics` of the measured tables in an open store of N sources, N rows after a column `name`.

    Raises NeumatError where an entry of LINE is missing in the store.
    """
    entries = torch.from_numpy(sources.entries).long()
    if not torch.isin(LINE, entries).all():
        raise NeumatError("sources", "valid entries at theta_d = phi_d = 0", "a gap")
    line, parts, rows = np.searchsorted(sources.entries, LINE.numpy()), split(entries), []
    for i in progress(range(sources.n)):
        table = torch.from_numpy(sources.table(i)).T[None]
        inner, grazing = ((table[:, :, positions] for positions in part.split(BLOCK)) for part in parts)
        rows.append(statistics(1, inner, grazing, table[:, :, line], f_diffuse))
    table = pd.concat(rows, ignore_index=True)
    table.insert(0, "name", sources.names)
    return table
