"""Procedural maps that repeat seamlessly: masks to blend materials by, and heights for bump and normal maps."""

import numpy as np

from neumat.errors import NeumatError

SIZE = 512  # texels along either side
SLOPE = 0.35  # of a normal map, at its steepest


def checker(u, v):
    """Squares, two by two."""
    return ((u < 0.5) ^ (v < 0.5)).astype(float)


def veins(u, v):
    """Thin winding lines, as of marble."""
    turn = 2 * np.pi
    warp = 0.18 * np.sin(turn * (2 * v + 0.3 * np.sin(turn * u))) + 0.07 * np.sin(turn * (5 * u + 3 * v))
    return np.exp(-((np.sin(turn * (u + warp)) / 0.35) ** 2))


def spots(u, v):
    """Soft round spots, in rows set off from each other."""
    rows = 4 * v
    x, y = (4 * u + 0.5 * (np.floor(rows) % 2)) % 1 - 0.5, rows % 1 - 0.5
    return 1 / (1 + np.exp(40 * (np.hypot(x, y) - 0.3)))


def hammered(u, v):
    """Round dents, side by side."""
    rng = np.random.default_rng(0)
    height = np.ones_like(u)
    for x, y, radius in np.column_stack([rng.random((90, 2)), rng.uniform(0.07, 0.13, 90)]):
        # Of the copies of a dent around the tile, the nearest.
        across, along = (u - x + 0.5) % 1 - 0.5, (v - y + 0.5) % 1 - 0.5
        height = np.minimum(height, (across**2 + along**2) / radius**2)
    return height


def weave(u, v):
    """Threads that pass over and under each other."""
    turn = 8 * np.pi
    over = 0.5 + 0.5 * np.tanh(3 * np.sin(turn * u / 2) * np.sin(turn * v / 2))
    return over * (0.5 + 0.5 * np.cos(turn * u) ** 2) + (1 - over) * (0.2 + 0.5 * np.cos(turn * v) ** 2)


MASKS = {mask.__name__: mask for mask in (checker, veins, spots)}
HEIGHTS = {height.__name__: height for height in (hammered, weave)}


def texture(registry, name):
    """Return the map (SIZE, SIZE), float32, 0..1, of a name in MASKS or HEIGHTS; raises NeumatError for another."""
    if name not in registry:
        raise NeumatError("texture", f"one of {', '.join(registry)}", repr(name))
    at = (np.arange(SIZE) + 0.5) / SIZE
    u, v = np.meshgrid(at, at)
    return registry[name](u, v).astype(np.float32)


def normal_map(height):
    """Return the normals (n, n, 3), float32, as colours n / 2 + 1/2, of a height map (n, n) that repeats."""
    down, across = (np.roll(height, -1, axis) - np.roll(height, 1, axis) for axis in (0, 1))
    steepest = max(np.abs(down).max(), np.abs(across).max(), 1e-9)
    normals = np.stack([-across * SLOPE / steepest, -down * SLOPE / steepest, np.ones_like(height)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return (0.5 + 0.5 * normals).astype(np.float32)
