"""Embossed metal: a plate of raised lozenges, each across its neighbours, exactly regular."""

import torch

from neumat.btf.surfaces.lattice import Lattice, smoothstep


def metal(points, seed, period, pairs, length, width):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 the plate, 1 the lozenges.

    pairs: lozenges of one direction along a side; length, width: of a lozenge, in its cell's diagonals.
    """
    cells, fractions = Lattice([2 * pairs, 2 * pairs], seed, period).locate(points)
    x, y = fractions - 0.5
    sign = torch.where((cells[0] + cells[1]) % 2 == 0, 1.0, -1.0)
    along, across = (x + sign * y) / length, (x - sign * y) / width
    inside = 1 - along * along - across * across
    return smoothstep(1.1 * inside), (inside > 0.25).long()
