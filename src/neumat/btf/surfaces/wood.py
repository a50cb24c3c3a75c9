"""Wood, planed: growth rings, and pores along the grain."""

import torch

from neumat.btf.surfaces.lattice import Lattice, fractal, noise, smoothstep


def wood(points, seed, period, rings, pores, waviness):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 early wood, 1 late wood, 2 pores. Grain along y.

    rings: along a side; pores: share of the places that hold one; waviness: of the grain, in rings.
    """
    wave = noise(points, [2, 1], seed, period, 10) + 0.5 * noise(points, [4, 1], seed, period, 11)
    moved = torch.stack([wave * (waviness / rings), torch.zeros_like(wave)])
    _, (phase, _) = Lattice([rings, 1], seed, period).locate(points, moved)
    fibres = fractal(points, [64, 3], seed, period, 3, 20, moved)
    late = phase * phase * phase * smoothstep((1 - phase) / 0.1) + 0.3 * fibres
    pits = torch.maximum(
        _pores(points, moved, phase, rings, [90, 5], pores, seed, period, 0),
        _pores(points, moved, phase, rings, [150, 11], 0.4 * pores, seed, period, 3),
    )
    height = 0.15 * late + 0.1 * fibres - pits
    return height, torch.where(pits > 0.3, 2, (late > 0.45).long())


def _pores(points, moved, phase, rings, counts, share, seed, period, channel):
    """Return (n,): 1 along the middle of a pore, 0 outside. The early wood, just after a ring, has most of them."""
    lattice = Lattice(counts, seed, period)
    channels = range(channel, channel + 3)
    ways, (chance, size) = lattice.around(*lattice.locate(points, moved), 1, 0.8, channels)
    middle = phase + ways[0] * (rings / counts[0])
    middle = middle - middle.floor()
    across = ways[0] / (0.2 + 0.2 * size[0])
    along = ways[1] / (0.2 + 0.4 * size[1])
    along = along * along
    inside = (1 - across * across - along * along).clamp_min(0)
    present = chance[0] < share * (1.6 - 3 * (middle - 0.15).abs())
    return torch.where(present, inside, 0.0).amax(0)
