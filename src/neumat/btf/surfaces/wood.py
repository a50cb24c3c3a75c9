"""Wood, planed: growth rings, and pores along the grain."""

import torch

from neumat.btf.surfaces.lattice import Lattice, fractal, noise


def wood(points, seed, period, rings, pores, waviness):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 early wood, 1 late wood, 2 pores. Grain along y.

    rings: along a side; pores: share of places that hold one; waviness: of the grain, in rings.
    """
    wave = noise(points, [2, 1], seed, period, 10) + 0.4 * noise(points, [5, 2], seed, period, 11)
    moved = torch.stack([wave * waviness / rings, torch.zeros_like(wave)])
    _, fractions = Lattice([rings, 1], seed, period).locate(points, moved)
    phase = fractions[0]
    fibres = fractal(points, [48, 3], seed, period, 3, 20, moved)
    late = phase * phase * phase + 0.25 * fibres
    early = (1 - 2 * (phase - 0.2).abs()).clamp_min(0)
    pits = torch.maximum(
        _pores(points, moved, [72, 5], early, pores, seed, period, 0),
        _pores(points, moved, [110, 9], 0.4 + 0.2 * early, pores, seed, period, 5),
    )
    height = 0.12 * late + 0.1 * fibres - pits
    return height, torch.where(pits > 0.3, 2, (late > 0.45).long())


def _pores(points, moved, counts, width, share, seed, period, channel):
    """Return (n,): 1 along the middle of a pore, 0 outside."""
    lattice = Lattice(counts, seed, period)
    around, ways = lattice.points_around(*lattice.locate(points, moved), 1, 0.8, channel)
    chance, size = lattice.pair(around, channel + 1)
    across = ways[0] / (0.35 * width.clamp_min(0.05))
    along = ways[1] / (0.25 + 0.45 * size)
    inside = (1 - across * across - along * along * along * along).clamp_min(0)
    return torch.where(chance < share, inside, 0.0).amax(0)
