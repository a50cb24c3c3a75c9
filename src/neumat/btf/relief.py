"""The relief of a part of a surface: a height field of triangles, with a material at each vertex.

Vertices lie on a lattice of all of the surface, `quads` to a texel, so that neighbouring parts share them. Coordinates
are relative to the part's own corner, in sides of the exemplar: single precision is as good at texel 10^4 as at 0.
"""

import math
from dataclasses import dataclass

import numpy as np
import torch

BLOCK = 1 << 16  # points at which a surface is evaluated at a time
RANGE_GRID = 128  # points along an exemplar's side among which its lowest and highest are looked for


@dataclass(frozen=True)
class Relief:
    """heights, slopes_x, slopes_y (r, c), float32, and materials (r, c), uint8, at the vertices; step: side of a quad;
    corner: x, and y, of the first vertex. Lengths in sides of the exemplar."""

    heights: np.ndarray
    slopes_x: np.ndarray
    slopes_y: np.ndarray
    materials: np.ndarray
    step: float
    corner: float

    @property
    def faces(self):
        """Return the triangles (n, 3), uint32, as vertices: 2 q and 2 q + 1 are those of quad q, row by row."""
        numbers = np.arange(self.heights.size, dtype=np.uint32).reshape(self.heights.shape)
        a, b, c, d = numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, :-1], numbers[1:, 1:]
        return np.stack([a, b, d, a, d, c], -1).reshape(-1, 3)

    @property
    def positions(self):
        """Return the vertices (n, 3), float32."""
        rows, columns = self.heights.shape
        x, y = (self.corner + np.arange(n) * self.step for n in (columns, rows))
        grid = np.broadcast_to(x, (rows, columns)), np.broadcast_to(y[:, None], (rows, columns)), self.heights
        return np.stack(grid, -1).reshape(-1, 3).astype(np.float32)


def _at(surface, x, y):
    """Return heights, float64, and materials, uint8, (r, c) on the grid of x (c,) and y (r,), a few rows at a time."""
    heights, materials = np.empty((len(y), len(x))), np.empty((len(y), len(x)), np.uint8)
    rows = max(1, BLOCK // len(x))
    for first in range(0, len(y), rows):
        part = slice(first, first + rows)
        u = torch.from_numpy(np.stack(np.meshgrid(x, y[part]), -1).reshape(-1, 2))
        height, material = surface.at(u)
        heights[part], materials[part] = height.view(-1, len(x)).numpy(), material.view(-1, len(x)).numpy()
    return heights, materials


def height_range(surface):
    """Return the lowest and the highest height of an exemplar, in sides of the exemplar."""
    centres = (np.arange(RANGE_GRID) + 0.5) / RANGE_GRID
    heights, _ = _at(surface, centres, centres)
    return float(heights.min()), float(heights.max())


def relief(surface, texels, rows, columns, margin, quads=2):
    """Return the Relief of a part of a surface.

    surface: has `at(u)`, as `btf.surfaces.surface.Surface`; texels: along a side of the exemplar; rows, columns:
    ranges of the texels wanted; margin: width of the border around them, in sides of the exemplar; quads: to a side
    of a texel.
    """
    border = math.ceil(margin * texels * quads)
    step = 1 / (texels * quads)
    # One more vertex all around, for slopes that don't depend on where the part ends.
    x, y = (np.arange(part.start * quads - border - 1, part.stop * quads + border + 2) for part in (columns, rows))
    heights, materials = _at(surface, x * step, y * step)
    return Relief(
        heights[1:-1, 1:-1].astype(np.float32),
        ((heights[1:-1, 2:] - heights[1:-1, :-2]) / (2 * step)).astype(np.float32),
        ((heights[2:, 1:-1] - heights[:-2, 1:-1]) / (2 * step)).astype(np.float32),
        materials[1:-1, 1:-1],
        step,
        -border * step,
    )
