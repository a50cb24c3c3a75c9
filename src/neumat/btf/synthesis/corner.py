"""Corner tiles (Lagae and Dutre 2006) cut out of the exemplar by minimum error, for irregular structure."""

import math

import torch

from neumat.btf.hashing import hashed_integers
from neumat.btf.planes import fetch
from neumat.btf.synthesis.base import Synthesis
from neumat.btf.synthesis.corner_tiles import ANCHORS, LAYERS, cut_tiles
from neumat.btf.synthesis.frame import Frame
from neumat.btf.synthesis.lattice import Cells, autocovariance, cell_sides, whole_and_rest
from neumat.seeds import torch_generator

COLOURS = (4, 3, 2)  # as many as the budget allows
BUDGET = 4  # times the exemplar's plane: the most that is stored
LARGEST_SIDE, LEAST_SIDE = 0.42, 0.3  # of a tile, in exemplars
ALIKE = 0.2  # autocorrelation from which on a lag counts as one of a lattice


class Corner(Synthesis):
    """Tiles for all choices of colours at their four corners; one fetch and no blending, so no ghosts.

    The corners of an endless grid have colours by a hash, which choose the tile between them. A tile says for each of
    its samples which patch of the exemplar shows there; patches are shifted by whole texels. If the exemplar has a
    lattice, the tiles' sides are lags of it, else they are parallel to the axes and 0.3 to 0.4 exemplars long.
    """

    def __init__(self, plane, seed, tileable=False, levels=None):
        super().__init__(plane, seed, tileable, levels)
        self.base = plane[0, 0]
        self.levels = [level - self.base for level in self.exemplar]
        self.colours, scale = self._budget()
        sides = self._sides(plane, scale)
        self.cells = Cells(sides)
        self.steps = [max(1, round(math.hypot(*side))) for side in sides]
        frame = Frame(plane, sides, self.steps, tileable)
        self.layers, first = cut_tiles(frame, self.colours, *self.steps, torch_generator(seed, "corner tiles"))
        self.first = frame.texels(first).int()
        self.anchors = torch.tensor(ANCHORS, device=plane.device)
        self.stored = [*self.levels, self.base, self.layers, self.first]

    def _features(self, cell, fraction, level):
        x, rest_x = whole_and_rest(cell[:, 0], fraction[:, 0], self.width, -0.5)
        y, rest_y = whole_and_rest(cell[:, 1], fraction[:, 1], self.height, -0.5)
        i, j, f, g = self.cells.split(x, y, rest_x, rest_y)
        tile = 0
        for down in (0, 1):
            for right in (0, 1):
                draw = hashed_integers(torch.stack([i + right, j + down], -1), self.seed)
                tile = tile * self.colours + (draw * self.colours >> 32)
        # Of a NaN the sample is arbitrary.
        column = (f * self.steps[0] + 0.5).long().clamp(0, self.steps[0])
        row = (g * self.steps[1] + 0.5).long().clamp(0, self.steps[1])
        _, rows, columns = self.layers.shape
        layer = self.layers.flatten()[(tile * rows + row) * columns + column].long()
        anchor = self.anchors[layer]
        corner_x, corner_y = self.cells.point(2 * (i + anchor[:, 0]), 2 * (j + anchor[:, 1]))
        first = self.first.flatten(0, 1)[tile * LAYERS + layer]
        x = (first[:, 0] + (x - corner_x) + rest_x + 0.5) / self.width
        y = (first[:, 1] + (y - corner_y) + rest_y + 0.5) / self.height
        return fetch(self.levels[min(level, self.top)], torch.stack([x, y], -1), self.tileable) + self.base

    def _budget(self):
        """Return the number of colours, and the largest side of a tile in exemplars."""
        plane = self.width * self.height * self.channels * 4
        left = BUDGET * plane - sum(level.numel() for level in self.levels) * 4 - self.channels * 4
        for colours in COLOURS:
            samples = max(0.0, left / colours**4 - 2 * LAYERS * 4)
            scale = min(LARGEST_SIDE, (samples / (self.width * self.height)) ** 0.5)
            if scale >= LEAST_SIDE:
                break
        return colours, scale

    def _sides(self, plane, scale):
        """Return the sides of a tile in texels, [(x, y), (x, y)]."""
        most = [int(scale * n) - 1 for n in (self.width, self.height)]
        if min(most) < 4:
            return [(1.0, 0.0), (0.0, 1.0)]
        sides, alike = cell_sides(autocovariance(plane, self.tileable), most[0] * most[1] / 5, most)
        return sides if alike > ALIKE else [(float(most[0]), 0.0), (0.0, float(most[1]))]
