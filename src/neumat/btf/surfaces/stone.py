"""Concrete with pebbles: a rough ground, and rounded inclusions at irregular places."""

import torch

from neumat.btf.surfaces.lattice import Lattice, fractal, noise


def stone(points, seed, period, pebbles, density, roughness):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 the ground, 1 and 2 pebbles.

    pebbles: places for large ones along a side; density: share of the places that are taken; roughness: height of the
    ground's, in heights of a pebble.
    """
    bend = noise(points, [3 * pebbles] * 2, seed, period, 10) + 0.4 * noise(points, [7 * pebbles] * 2, seed, period, 11)
    ground = fractal(points, [4 * pebbles] * 2, seed, period, 4, 20)
    large = _pebbles(points, pebbles, density, 1.0, seed, period, 0)
    small = _pebbles(points, 9 * pebbles // 4, density, 0.6, seed, period, 4)
    small[0] += 2 * (1.2 - large[0].amin(0)).clamp_min(0)  # none lies on a large one
    inside, high, kind = (torch.cat(parts) for parts in zip(large, small, strict=True))
    nearest, which = inside.topk(2, 0, largest=False)
    # Where two would overlap, a seam parts them.
    seam = (1 - (nearest[1] - nearest[0]) / 0.6).clamp_min(0)
    edge = nearest[0] * (1 + 0.3 * bend) + seam
    high, kind = high.gather(0, which[:1])[0], kind.gather(0, which[:1])[0]
    top = high * (1 - edge * edge) + 0.04 * bend
    ground = roughness * ground
    return torch.maximum(ground, top), torch.where(top > ground, kind, 0)


def _pebbles(points, count, density, high, seed, period, channel):
    """Return of the pebbles around each point how far out of the middle it is, squared (1 at the rim; 9 where there is
    none), the height of their tops and their kinds, all (k, n)."""
    lattice = Lattice([count, count], seed, period)
    channels = range(channel, channel + 4)
    ways, (size, rise, along) = lattice.around(*lattice.locate(points), 1, 0.7, channels)
    along = along * 2 - 1
    length = (along[0] * along[0] + along[1] * along[1]).sqrt() + 1e-9
    a = (ways[0] * along[0] + ways[1] * along[1]) / length
    b = (ways[0] * along[1] - ways[1] * along[0]) / (length * (0.65 + 0.35 * rise[1]))
    radius = 0.28 + 0.2 * size[1]
    inside = torch.where(size[0] < density, (a * a + b * b) / (radius * radius), 9.0).clamp_max(9)
    return [inside, high * (0.5 + 0.5 * rise[0]), torch.where(rise[1] < 0.5, 1, 2)]
