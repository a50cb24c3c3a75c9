"""Corner tiles (Lagae and Dutre 2006) cut out of the exemplar by minimum error, for irregular structure."""

import torch

from neumat.btf.hashing import hashed_integers
from neumat.btf.planes import fetch, prefilter
from neumat.btf.synthesis.base import Synthesis
from neumat.btf.synthesis.corner_tiles import LAYERS, cut_tiles
from neumat.btf.synthesis.lattice import autocovariance
from neumat.seeds import torch_generator

COLOURS = (4, 3, 2)  # as many as the budget allows
BUDGET = 4  # times the exemplar's plane: the most that is stored
LARGEST_SIDE, LEAST_SIDE = 0.42, 0.3  # of a tile, in exemplars


class Corner(Synthesis):
    """Tiles for all choices of colours at their four corners; no blending, so no ghosts.

    The corners of an endless grid have colours by a hash, which choose the tile between them. A tile's side is 0.2 to
    0.4 exemplars: a lag at which the exemplar looks like itself, if there is one. A tile says which texel of the
    exemplar each of its samples shows. Samples lie on its borders, too, and neighbours share them, so that features at
    level 0 are continuous; at coarser levels they are those of the exemplar round the nearest sample's texel.
    """

    def __init__(self, plane, seed, tileable=False):
        super().__init__(plane, seed, tileable)
        self.base = plane[0, 0]
        self.levels = prefilter(plane - self.base)
        correlation = autocovariance(plane, tileable)
        self.colours, self.steps = self._sizes(correlation)
        generator = torch_generator(seed, "corner tiles")
        self.tiles = cut_tiles(plane, correlation, self.colours, *self.steps, tileable, generator)
        self.stored = [*self.levels, self.base, *self.tiles]

    def _features(self, cell, fraction, level):
        level = min(level, self.top)
        tiles, samples, places = self._place(cell, fraction)
        if level == 0:
            return self._interpolated(tiles, samples, places)
        near = [sample + (place >= 0.5).long() for sample, place in zip(samples, places, strict=True)]
        row, column = self._texels(tiles, *near)
        x = (column + 0.5 + samples[0] + places[0] - near[0]) / self.width
        y = (row + 0.5 + samples[1] + places[1] - near[1]) / self.height
        return fetch(self.levels[level], torch.stack([x, y], -1), self.tileable) + self.base

    def _interpolated(self, tiles, samples, places):
        """Return features between the four samples round positions in `tiles` (n,)."""
        x, y = (place.float() for place in places)
        texels, weights = [], []
        for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
            row, column = self._texels(tiles, samples[0] + i, samples[1] + j)
            texels.append(row * self.width + column)
            weights.append((x if i else 1 - x) * (y if j else 1 - y))
        table = self.levels[0].reshape(-1, self.channels)
        texels, weights = torch.stack(texels, -1), torch.stack(weights, -1)
        return torch.nn.functional.embedding_bag(texels, table, mode="sum", per_sample_weights=weights) + self.base

    def _place(self, cell, fraction):
        """Return the tiles (n,) at positions, the samples left of and above them, x and y, and the places between."""
        corners, samples, places = [], [], []
        for axis, (size, steps) in enumerate(zip((self.width, self.height), self.steps, strict=True)):
            texel = fraction[:, axis] * size - 0.5
            whole = torch.floor(texel)
            number = cell[:, axis] * size + whole.long()
            corner = torch.div(number, steps, rounding_mode="floor")
            corners.append(corner)
            # Of a NaN the number is arbitrary.
            samples.append((number - corner * steps).clamp(0, steps - 1))
            places.append(texel - whole)
        tile = 0
        for j in (0, 1):
            for i in (0, 1):
                draw = hashed_integers(torch.stack([corners[0] + i, corners[1] + j], -1), self.seed)
                tile = tile * self.colours + (draw * self.colours >> 32)
        return tile, samples, places

    def _texels(self, tiles, x, y):
        """Return the rows and columns of the exemplar's texels that `tiles` (n,) show at samples (x, y)."""
        layers, rows, columns = self.tiles
        sample = (tiles * layers.shape[1] + y) * layers.shape[2] + x
        source = tiles * LAYERS + layers.flatten()[sample]
        row, column = rows.flatten()[source] + y, columns.flatten()[source] + x
        return row.remainder(self.height), column.remainder(self.width)

    def _sizes(self, correlation):
        """Return the number of colours and the steps between samples (x, y) along a tile's sides."""
        plane = self.width * self.height * self.channels * 4
        left = BUDGET * plane - sum(level.numel() for level in self.levels) * 4 - self.channels * 4
        for colours in COLOURS:
            side = max(0.0, left / colours**4 - 2 * LAYERS * 4) ** 0.5  # in samples, of a square exemplar
            scale = min(LARGEST_SIDE, side / (self.width * self.height) ** 0.5)
            if scale >= LEAST_SIDE or colours == COLOURS[-1]:
                break
        most = [int(scale * n) - 1 for n in (self.width, self.height)]
        if min(most) < 4:
            return COLOURS[-1], (1, 1)
        middle = correlation[self.height - 1, self.width - 1 :], correlation[self.height - 1 :, self.width - 1]
        steps = []
        for line, n in zip(middle, most, strict=True):
            lags = torch.arange(max(4, n // 2), n + 1)
            steps.append(lags[(line.cpu()[lags] + 0.3 * lags / n).argmax()].item())
        return colours, tuple(steps)
