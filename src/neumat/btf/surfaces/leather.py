"""Leather: irregular pebbles between creases, with fine wrinkles and pores."""

import torch

from neumat.btf.surfaces.lattice import Lattice, fractal, noise


def leather(points, seed, period, cells, crease, wrinkles, pores):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 the hide, 1 its creases and pores.

    cells: pebbles along a side; crease: width of a crease, in pebbles; wrinkles: height of the wrinkles, in heights of
    a pebble; pores: share of small cells that hold one.
    """
    moved = torch.stack([noise(points, [cells, cells], seed, period, channel) for channel in (10, 11)]) * (0.25 / cells)
    valleys = _creases(points, moved, cells, crease, seed, period)
    folds = sum(_fold(noise(points, [count * cells] * 2, seed, period, 12 + count, moved)) for count in (2, 5))
    pits = _pits(points, 4 * cells, pores, seed, period)
    grain = fractal(points, [12 * cells] * 2, seed, period, 2, 30)
    swell = noise(points, [2 * cells] * 2, seed, period, 12)
    pebbles = 1 / (1 + 2 * valleys)
    height = pebbles * (1 + 0.15 * swell) - wrinkles * pebbles * folds + 0.02 * grain - 0.12 * pits
    return height, ((valleys > 1.15) | (pits > 0.4)).long()


def _fold(values):
    """Return (n,): 1 along the lines where the noise `values` (n,) is 0, falling to 0 beside them."""
    near = (1 - 3 * values.abs()).clamp_min(0)
    return near * near


def _creases(points, moved, cells, width, seed, period):
    """Return (n,): 0 inside a cell, 1 on a border between two, 2 where three meet.

    Of Worley's distances F_i to the points of the cells: the sum of (1 - (F_i - F_1) / width)^2 over those within
    reach, but for the first.
    """
    lattice = Lattice([cells, cells], seed, period)
    ways, _ = lattice.around(*lattice.locate(points, moved), 2, 0.95, [0])
    distances = (ways[0] * ways[0] + ways[1] * ways[1]).sqrt()
    near = (1 - (distances - distances.amin(0)) * (1 / width)).clamp_min(0)
    return _added(near * near) - 1


def _pits(points, cells, share, seed, period):
    """Return (n,): 1 at the bottom of a pore, 0 outside."""
    lattice = Lattice([cells, cells], seed, period)
    ways, ((chance, size),) = lattice.around(*lattice.locate(points), 1, 0.6, [2, 3])
    radius = 0.15 + 0.15 * size
    inside = (1 - (ways[0] * ways[0] + ways[1] * ways[1]) / (radius * radius)).clamp_min(0)
    return torch.where(chance < share, inside, 0.0).amax(0)


def _added(parts):
    """Return the sum (n,) of parts (k, n), in a fixed order."""
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total
