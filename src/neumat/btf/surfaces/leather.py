"""Leather: irregular pebbles between creases, with fine wrinkles and pores."""

import torch

from neumat.btf.surfaces.lattice import Lattice, fractal, noise


def leather(points, seed, period, cells, crease, wrinkles, pores):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 the hide, 1 its creases and pores.

    cells: pebbles along a side; crease: width of a crease in pebbles; wrinkles: height of wrinkles; pores: share of
    small cells that hold one.
    """
    moved = torch.stack([noise(points, [2 * cells] * 2, seed, period, channel) for channel in (10, 11)]) * 0.22 / cells
    valleys = _creases(points, moved, cells, crease, seed, period, 0)
    fine = _creases(points, moved * 0.5, 4 * cells, 0.5, seed, period, 1)
    grain = fractal(points, [8 * cells] * 2, seed, period, 2, 20)
    pebbles = 1 / (1 + 2.5 * valleys)
    pits = _pits(points, 3 * cells, pores, seed, period)
    height = pebbles - wrinkles * (fine / (1 + fine)) * (0.4 + 0.6 * pebbles) + 0.04 * grain - 0.25 * pits * pebbles
    dark = (valleys > 1.1) | (pits > 0.5)
    return height, dark.long()


def _creases(points, moved, cells, width, seed, period, channel):
    """Return (n,): 0 inside a cell, 1 on a border between two, 2 where three meet.

    Worley's distances F_i to the points of the cells: the sum of (1 - (F_i - F_1) / width)^2 over those within reach.
    """
    lattice = Lattice([cells, cells], seed, period)
    _, ways = lattice.points_around(*lattice.locate(points, moved), 2, 0.85, channel)
    distances = (ways[0] * ways[0] + ways[1] * ways[1]).sqrt()
    near = (1 - (distances - distances.amin(0)) / width).clamp_min(0)
    return _added(near * near) - 1


def _pits(points, cells, share, seed, period):
    """Return (n,): 1 at the bottom of a pore, 0 outside."""
    lattice = Lattice([cells, cells], seed, period)
    around, ways = lattice.points_around(*lattice.locate(points), 1, 0.6, 2)
    chance, size = lattice.pair(around, 3)
    radius = 0.12 + 0.12 * size
    inside = (1 - (ways[0] * ways[0] + ways[1] * ways[1]) / (radius * radius)).clamp_min(0)
    return torch.where(chance < share, inside, 0.0).amax(0)


def _added(parts):
    """Return the sum (n,) of parts (k, n), in a fixed order."""
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total
