"""Hex tiling (Mikkelsen 2022), without rotation: a patch that is turned would need light and view turned with it."""

import torch

from neumat.btf.planes import fetch, prefilter
from neumat.btf.synthesis.base import Synthesis
from neumat.btf.synthesis.triangles import Grid

CONTRAST = 0.6  # how much a patch's brightness counts in its weight


class Hex(Synthesis):
    """Three patches over each position with sharpened weights, in which brighter texels count more.

    A weight is the barycentric one to the power 7, times the patch's brightness there: its place between the darkest
    and the brightest features along the direction in which features vary most, upwards in their sum.
    """

    fetches = 3

    def __init__(self, plane, seed, tileable=False, levels=None):
        super().__init__(plane, seed, tileable, levels)
        self.base = plane[0, 0]
        rows = (plane - self.base).flatten(0, 1).double()
        rows = rows - rows.mean(0)
        _, vectors = torch.linalg.eigh(rows.T @ rows)
        along = rows @ (vectors[:, -1] * vectors[:, -1].sum().sign())
        spread = (along.max() - along.min()).clamp_min(1e-12)
        brightness = ((along - along.min()) / spread).float().reshape(self.height, self.width, 1)
        # As one more channel of the plane: one fetch gives both.
        pairs = zip(self.exemplar, prefilter(brightness), strict=True)
        self.levels = [torch.cat([level - self.base, bright], -1) for level, bright in pairs]
        self.stored = [*self.levels, self.base]
        self.grid = Grid(self.height, self.width, seed, tileable)

    def _features(self, cell, fraction, level):
        plane = self.levels[min(level, self.top)]
        positions, weights = self.grid.patches(cell, fraction)
        patches = fetch(plane, positions.flatten(0, 1), self.tileable).unflatten(0, (-1, 3))
        square = weights * weights
        weights = square * square * square * weights
        weights = weights * (1 - CONTRAST + CONTRAST * patches[..., -1])
        a, b, c = weights.unbind(1)
        weights = (weights / (a + b + c)[:, None])[..., None]
        a, b, c = (patches[..., :-1] * weights).unbind(1)
        return a + b + c + self.base
