"""The contract of synthesis methods in Dr.Jit; the exemplar repeated, and quilted."""

import drjit as dr
import mitsuba as mi

from neumat.btf.compiled.planes import Pyramid
from neumat.btf.hashing import key, mix


class EndlessPlane:
    """Features at any position. Subclasses define `features`(cells (x, y) Int64, fractions (x, y) Float64, level)."""

    def __init__(self, synthesis):
        self.size, self.top = (synthesis.width, synthesis.height), synthesis.top
        self.seed = synthesis.seed

    def at(self, u, level=None):
        """Return the features [Float] at u, a Point2d in exemplars; level: Float, see `Synthesis.at`; None: 0."""
        cells = [dr.floor(x) for x in u]
        fractions = [x - cell for x, cell in zip(u, cells, strict=True)]
        cells = [mi.Int64(cell) for cell in cells]
        if level is None:
            return self.features(cells, fractions, None)
        level = dr.clip(level, 0.0, float(self.top))
        lower = dr.floor(level)
        place = level - lower
        lower = mi.UInt32(lower)
        near = self.features(cells, fractions, lower)
        far = self.features(cells, fractions, dr.minimum(lower + 1, self.top))
        return [dr.lerp(*pair, place) for pair in zip(near, far, strict=True)]

    def drawn(self, count, cells):
        """Return a draw, UInt32, from 0..count - 1 for cells [Int64]."""
        return mi.UInt32(mi.UInt64(self.hashed(cells)) * count >> 32)

    def hashed(self, cells):
        """Return the UInt32 of `hashed_integers` for cells [Int64]."""
        start = key(self.seed)
        state = mi.UInt32(start)
        for cell in cells:
            state = mix(state + mi.UInt32(cell)) ^ start
        return state


class TilingPlane(EndlessPlane):
    """The exemplar repeated."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.pyramid, self.base = Pyramid(synthesis.levels, True), synthesis.base.tolist()

    def features(self, cells, fractions, level):
        place = [mi.Float(fraction) for fraction in fractions]
        return [x + base for x, base in zip(self.pyramid.fetch(*place, level), self.base, strict=True)]


class QuiltingPlane(TilingPlane):
    """A plane of several exemplars, repeated."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.extent = synthesis.extent

    def features(self, cells, fractions, level):
        within = [
            (mi.Float64(rest(cell, self.extent)) + x) / self.extent for cell, x in zip(cells, fractions, strict=True)
        ]
        return super().features(cells, within, level)


def rest(x, divisor):
    """Return the rest, within 0..divisor - 1, of the division of integers of either sign by divisor > 0."""
    found = x % divisor
    return dr.select(found < 0, found + divisor, found)
