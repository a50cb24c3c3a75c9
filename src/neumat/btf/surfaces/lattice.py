"""Lattices of random cells, and smooth noise on them, that repeat after a period or never do.

Points (2, n) are float64, in units of the exemplar's side. Only sums, products, quotients, square roots and roundings
are used: IEEE arithmetic gives the same bits in any batch. Cells and fractions are kept apart, so that what repeats
does so to the last bit wherever the points themselves are exact.
"""

import torch

from neumat.btf.hashing import hashed_integers

AROUND = {
    reach: torch.cartesian_prod(*[torch.arange(-reach, reach + 1)] * 2).T[..., None].contiguous() for reach in (1, 2)
}


class Lattice:
    """`counts` (x, y) cells per exemplar, integers, drawn from `seed`; `period` in exemplars, None where endless."""

    def __init__(self, counts, seed, period):
        self.counts = torch.tensor(counts, dtype=torch.int64)
        self.seed, self.period = seed, period

    def locate(self, points, moved=None):
        """Return the cells (2, n), int64, and the fractions (2, n), 0 to 1, of `points` moved by `moved` (2, n)."""
        counts = self.counts.double()[:, None]
        scaled = points * counts
        cells = scaled.floor()
        fractions = scaled - cells
        if moved is not None:
            fractions = fractions + moved * counts
            whole = fractions.floor()
            cells, fractions = cells + whole, fractions - whole
        return cells.long(), fractions

    def integers(self, cells, channel=0):
        """Return the hash (...) of the cells (2, ...): 0 to 2^32 - 1."""
        if self.period is not None:
            counts = (self.counts * self.period).reshape(2, *[1] * (cells.ndim - 1))
            cells = torch.remainder(cells, counts)
        return hashed_integers(cells.movedim(0, -1), self.seed, channel)

    def pair(self, cells, channel=0):
        """Return two numbers (2, ...), 0 to 1, of the cells (2, ...)."""
        integers = self.integers(cells, channel)
        return torch.stack([integers >> 16, integers & 0xFFFF]).double() / 0x10000

    def points_around(self, cells, fractions, reach, spread, channel=0):
        """Return the cells (2, k, n) within `reach` of each point's own, and the way (2, k, n), in cells, from the
        point to one random point in each, which keeps (1 - spread) / 2 away from the border of its cell."""
        around = cells[:, None] + AROUND[reach]
        jitter = (self.pair(around, channel) - 0.5) * spread + 0.5
        return around, AROUND[reach] + jitter - fractions[:, None]


def noise(points, counts, seed, period, channel=0, moved=None):
    """Return gradient noise (n,), about -1 to 1, mean 0 (Perlin 2002, with gradients from a square)."""
    lattice = Lattice(counts, seed, period)
    cells, fractions = lattice.locate(points, moved)
    fade = fractions * fractions * fractions * (fractions * (fractions * 6 - 15) + 10)
    corners = torch.tensor([[0, 0, 1, 1], [0, 1, 0, 1]])[..., None]
    gradients = lattice.pair(cells[:, None] + corners, channel) * 2 - 1
    ways = fractions[:, None] - corners
    low0, low1, high0, high1 = gradients[0] * ways[0] + gradients[1] * ways[1]
    low, high = low0 + fade[1] * (low1 - low0), high0 + fade[1] * (high1 - high0)
    return 1.5 * (low + fade[0] * (high - low))


def fractal(points, counts, seed, period, octaves, channel=0, moved=None):
    """Return the sum (n,) of `octaves` of noise, each twice as fine and half as high as the one before."""
    parts = (
        noise(points, [count << k for count in counts], seed, period, channel + k, moved) / 2**k for k in range(octaves)
    )
    return sum(parts)


def smoothstep(x):
    """Return 0 below 0, 1 above 1, and a smooth rise (3 x^2 - 2 x^3) between."""
    x = x.clamp(0, 1)
    return x * x * (3 - 2 * x)
