"""Linear blending, a null: it keeps means and loses variance."""

from neumat.btf.planes import blend
from neumat.btf.synthesis.base import Synthesis
from neumat.btf.synthesis.triangles import Grid


class Linear(Synthesis):
    """Three patches over each position, weighted by the position's place in its triangle."""

    fetches = 3

    def __init__(self, plane, seed, tileable=False, levels=None):
        super().__init__(plane, seed, tileable, levels)
        self.base = plane[0, 0]
        self.stored = self.levels = [level - self.base for level in self.exemplar]
        self.grid = Grid(self.height, self.width, seed, tileable)

    def _features(self, cell, fraction, level):
        positions, weights = self.grid.patches(cell, fraction)
        return blend(self.levels[min(level, self.top)], positions, weights, self.tileable) + self.base
