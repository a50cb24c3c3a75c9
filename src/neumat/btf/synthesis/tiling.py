"""The null: the exemplar repeated."""

from neumat.btf.planes import fetch
from neumat.btf.synthesis.base import Synthesis


class Tiling(Synthesis):
    """The exemplar repeated; at the borders of one that does not tile the repetitions meet in a seam."""

    def __init__(self, plane, seed, tileable=False, levels=None):
        super().__init__(plane, seed, tileable, levels)
        self.base = plane[0, 0]
        self.stored = self.levels = [level - self.base for level in self.exemplar]

    def _features(self, cell, fraction, level):
        return fetch(self.levels[min(level, self.top)], fraction, wrap=True) + self.base
