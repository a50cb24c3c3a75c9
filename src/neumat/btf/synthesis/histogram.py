"""Histogram-preserving blending (Heitz and Neyret 2018)."""

from neumat.btf.synthesis.base import Synthesis
from neumat.btf.synthesis.gaussian import GaussianPlane
from neumat.btf.synthesis.triangles import Grid


class Histogram(Synthesis):
    """Three patches over each position, blended as Gaussian variables by weights w / |w|, which keep the histogram.

    Weights are the barycentric ones to the power 6: where one patch counts alone, its channels fit together. Patches
    keep inside an exemplar that does not tile (Burley 2019).

    decorrelate: blend principal components in place of the channels.
    """

    fetches = 3

    def __init__(self, plane, seed, tileable=False, levels=None, decorrelate=True):
        super().__init__(plane, seed, tileable, levels)
        self.grid = Grid(self.height, self.width, seed, tileable)
        self.gaussian = GaussianPlane(self.exemplar, self.grid.usage(plane.device), tileable, decorrelate)
        self.stored = self.gaussian.stored

    def _features(self, cell, fraction, level):
        positions, weights = self.grid.patches(cell, fraction)
        weights = weights * weights
        weights = weights * weights * weights
        a, b, c = weights.unbind(1)
        return self.gaussian.blend(min(level, self.top), positions, weights / (a * a + b * b + c * c).sqrt()[:, None])
