"""The null: the exemplar repeated."""

from neumat.btf.planes import fetch, prefilter
from neumat.btf.synthesis.base import Synthesis


class Tiling(Synthesis):
    """The exemplar repeated; at the borders of one that does not tile the repetitions meet in a seam."""

    def __init__(self, plane, seed, tileable=False):
        super().__init__(plane, seed, tileable)
        self.base = plane[0, 0]
        self.stored = self.levels = prefilter(plane - self.base)

    def _features(self, cell, fraction, level):
        return fetch(self.levels[min(level, self.top)], fraction, wrap=True) + self.base
