"""Planes of features in Dr.Jit: pyramids of levels of detail in one buffer, and bilinear fetches of them.

Everything works on the variant of Mitsuba that is set, which must be a compiled one.
"""

from itertools import accumulate

import drjit as dr
import mitsuba as mi
import torch

from neumat.render.drjit_brdf import buffer

GROUP = 4  # numbers that one gather reads


def padded(rows):
    """Return rows (n, c) with zeros after them, so that they are read in groups."""
    return torch.nn.functional.pad(rows, (0, -rows.shape[1] % GROUP))


def read(source, index, channels):
    """Return `channels` numbers [Float] of row `index` of a buffer of `padded` rows."""
    groups = -(-channels // GROUP)
    found = [dr.gather(mi.Vector4f, source, index * groups + k) for k in range(groups)]
    return [part[k] for part in found for k in range(GROUP)][:channels]


class Pyramid:
    """The levels of detail [(H, W, c)] of a plane, which repeats if it is to `wrap`; see `neumat.btf.planes`."""

    def __init__(self, levels, wrap):
        self.wrap, self.channels = wrap, levels[0].shape[2]
        self.sizes = [tuple(level.shape[:2]) for level in levels]
        firsts = [0, *accumulate(height * width for height, width in self.sizes)][:-1]
        self.values = buffer(torch.cat([padded(level.flatten(0, 1)) for level in levels]))
        self.places = [mi.Int32(list(each)) for each in (firsts, *zip(*self.sizes, strict=True))]

    def blend(self, positions, weights, level=None):
        """Return the sums [Float] of fetches at `positions` [(x, y)], in units of the plane's sides, times `weights`
        [Float]. level: which of them, a UInt32; None: the first."""
        if level is None:
            (height, width), first = self.sizes[0], 0
        else:
            first, height, width = (dr.gather(mi.Int32, table, level) for table in self.places)
        total = [mi.Float(0.0)] * self.channels
        for (x, y), weight in zip(positions, weights, strict=True):
            columns, across = self._taps(x, width)
            rows, down = self._taps(y, height)
            for row, share in zip(rows, (weight * (1 - down), weight * down), strict=True):
                for column, part in zip(columns, (share * (1 - across), share * across), strict=True):
                    texel = read(self.values, mi.UInt32(first + row * width + column), self.channels)
                    total = [dr.fma(part, value, sum_) for value, sum_ in zip(texel, total, strict=True)]
        return total

    def fetch(self, x, y, level=None):
        """Return the features [Float] at a position."""
        return self.blend([(x, y)], [mi.Float(1.0)], level)

    def _taps(self, position, size):
        """Return the two texels, Int32, between whose centres a position lies, and its place from one to the other."""
        if self.wrap:
            position = position - dr.floor(position)
        x = position * size - 0.5
        low = dr.floor(x)
        first = mi.Int32(low)
        second = first + 1
        if self.wrap:
            first, second = dr.select(first < 0, size - 1, first), dr.select(second >= size, 0, second)
        else:
            first, second = (dr.clip(each, 0, size - 1) for each in (first, second))
        return (first, second), x - low
