"""Bricks in rows, each row set off by half a brick, between mortar."""

import torch

from neumat.btf.surfaces.lattice import Lattice, fractal, smoothstep


def bricks(points, seed, period, columns, pairs, mortar, unevenness):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 the mortar, 1 and 2 bricks.

    columns: bricks along a side; pairs: of rows along a side; mortar: width of a joint, in rows; unevenness: how
    bricks differ in height and tilt.
    """
    counts = [columns, 2 * pairs]
    lattice = Lattice(counts, seed, period)
    cells, fractions = lattice.locate(points)
    odd = (cells[1] % 2).double()
    shifted = fractions[0] + 0.5 * odd
    whole = shifted.floor()
    cells = torch.stack([cells[0] + whole.long(), cells[1]])
    offset = torch.stack([shifted - whole, fractions[1]]) - 0.5
    rough = fractal(points, [8 * pairs] * 2, seed, period, 4, 20)
    edge = 0.5 - offset.abs()  # in bricks; below in rows
    across, down = edge[0] * (2 * pairs / columns), edge[1]
    corner = 0.18
    a, b = (corner - across).clamp_min(0), (corner - down).clamp_min(0)
    inside = (corner - (a * a + b * b).sqrt() - 0.5 * mortar + 0.035 * rough) / 0.12
    brick = smoothstep(inside)
    (high, kind), tilt = lattice.pairs(cells, [0, 1])
    tilt = tilt - 0.5
    top = 0.8 + unevenness * (high - 0.5 + tilt[0] * offset[0] + tilt[1] * offset[1]) + 0.06 * rough
    height = 0.12 * rough + brick * (top - 0.12 * rough)
    return height, torch.where(inside > 0.35, torch.where(kind < 0.7, 1, 2), 0)
