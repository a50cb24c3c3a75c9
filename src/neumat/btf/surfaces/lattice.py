"""Lattices of random cells, and smooth noise on them, that repeat after a period or never do.

Points (2, n) are float64, in units of the exemplar's side. Only sums, products, quotients, square roots and roundings
are used: IEEE arithmetic gives the same bits in any batch. Cells and fractions are kept apart, so that what repeats
does so to the last bit wherever the points themselves are exact.
"""

import torch

from neumat.btf.hashing import hashed_integers

# The lower cells of a point are those that meet at the corner nearest to it: 2 x 2 of them hold all that is within
# half a cell, 4 x 4 all within one and a half.
AROUND = {
    reach: torch.cartesian_prod(*[torch.arange(1 - reach, 1 + reach)] * 2).T[..., None].contiguous() for reach in (1, 2)
}
CORNERS = torch.tensor([[0, 0, 1, 1], [0, 1, 0, 1]])[..., None]


class Lattice:
    """`counts` (x, y) cells per exemplar, integers, drawn from `seed`; `period` in exemplars, None where endless."""

    def __init__(self, counts, seed, period):
        self.counts = torch.tensor(counts, dtype=torch.int64)[:, None]
        self.seed, self.period = seed, period

    def locate(self, points, moved=None):
        """Return the cells (2, n), int64, and the fractions (2, n), 0 to 1, of `points` moved by `moved` (2, n)."""
        scaled = points * self.counts
        cells = scaled.floor()
        fractions = scaled - cells
        if moved is not None:
            fractions = fractions + moved * self.counts
            whole = fractions.floor()
            cells, fractions = cells + whole, fractions - whole
        return cells.long(), fractions

    def around(self, cells, fractions, reach, spread, channels):
        """Return the ways (2, k, n), in cells, from points to one random point in each of the cells within `reach` of
        the nearest corner, and a pair (2, k, n) of random numbers of those cells for each of `channels`, the first of
        which places the point, at least (1 - spread) / 2 away from the border of its cell."""
        before = (fractions < 0.5).long()
        cells, fractions = (cells - before)[:, None], (fractions + before)[:, None]
        first, *others = self.pairs(cells + AROUND[reach], channels)
        return first * spread + (AROUND[reach] + 0.5 * (1 - spread) - fractions), others

    def pairs(self, cells, channels):
        """Return two random numbers (2, ...), 0 to 1, of the cells (2, ...) for each of `channels`.

        Where many points share few cells, numbers are drawn for the rectangle that holds all cells, and looked up.
        """
        flat = cells.flatten(1)
        low, high = flat.amin(1, keepdim=True), flat.amax(1, keepdim=True)
        across, down = (high - low + 1).flatten().tolist()
        if across * down > flat.shape[1] // 2:
            return [self._drawn(flat, channel).reshape(cells.shape) for channel in channels]
        box = torch.cartesian_prod(torch.arange(across), torch.arange(down)).T + low
        x, y = flat - low
        index = (x * down + y).expand(2, -1)
        return [self._drawn(box, channel).gather(1, index).reshape(cells.shape) for channel in channels]

    def _drawn(self, cells, channel):
        if self.period is not None:
            cells = torch.remainder(cells, self.counts * self.period)
        integers = hashed_integers(cells.T, self.seed, channel)
        return torch.stack([integers >> 16, integers & 0xFFFF]).double() / 0x10000


def noise(points, counts, seed, period, channel=0, moved=None):
    """Return gradient noise (n,), about -1 to 1, mean 0 (Perlin 2002, with gradients from a square)."""
    lattice = Lattice(counts, seed, period)
    cells, fractions = lattice.locate(points, moved)
    fade = fractions * fractions * fractions * (fractions * (fractions * 6 - 15) + 10)
    (gradients,) = lattice.pairs(cells[:, None] + CORNERS, [channel])
    slopes = (gradients * 2 - 1) * (fractions[:, None] - CORNERS)
    low0, low1, high0, high1 = slopes[0] + slopes[1]
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
