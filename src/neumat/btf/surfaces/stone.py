"""Concrete with pebbles: a rough ground, and rounded inclusions at irregular places."""

import torch

from neumat.btf.surfaces.lattice import Lattice, fractal, noise


def stone(points, seed, period, pebbles, density, roughness):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 the ground, 1 and 2 pebbles.

    pebbles: places for large ones along a side; density: share of places that are taken; roughness: of the ground.
    """
    bend = noise(points, [3 * pebbles] * 2, seed, period, 10) + 0.5 * noise(points, [7 * pebbles] * 2, seed, period, 11)
    ground = roughness * fractal(points, [2 * pebbles] * 2, seed, period, 5, 20)
    large, first = _pebbles(points, bend, pebbles, density, 1.0, seed, period, 0)
    small, second = _pebbles(points, bend, 9 * pebbles // 4, density, 0.5, seed, period, 5)
    top, kind = torch.maximum(large, small), torch.where(large >= small, first, second)
    top = top + 0.1 * roughness * bend
    return torch.maximum(ground, top), torch.where(top > ground, kind, 0)


def _pebbles(points, bend, count, density, high, seed, period, channel):
    """Return the heights (n,) of the highest pebble at each point, far below the ground outside, and its kind."""
    lattice = Lattice([count, count], seed, period)
    around, ways = lattice.points_around(*lattice.locate(points), 1, 0.7, channel)
    chance, size = lattice.pair(around, channel + 1)
    rise, kind = lattice.pair(around, channel + 2)
    along = lattice.pair(around, channel + 3) * 2 - 1
    length = (along[0] * along[0] + along[1] * along[1]).sqrt() + 1e-9
    a = (ways[0] * along[0] + ways[1] * along[1]) / length
    b = (ways[0] * along[1] - ways[1] * along[0]) / (length * (0.65 + 0.35 * rise))
    radius = 0.26 + 0.22 * size
    inside = (a * a + b * b) / (radius * radius) * (1 + 0.25 * bend)
    top = high * (0.6 + 0.6 * rise) * (1 - inside * inside)
    top, which = torch.where((chance < density) & (inside < 1.2), top, -1.0).max(0)
    kind = torch.where(kind.gather(0, which[None])[0] < 0.5, 1, 2)
    return top, kind
