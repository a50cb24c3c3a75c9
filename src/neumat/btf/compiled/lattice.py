"""Methods whose cells lie on an exemplar's lattice, in Dr.Jit; see `neumat.btf.synthesis.lattice`."""

import drjit as dr
import mitsuba as mi

from neumat.btf.compiled.endless import EndlessPlane, rest
from neumat.btf.compiled.gaussian import Gaussian
from neumat.btf.compiled.planes import Pyramid
from neumat.btf.synthesis.corner_tiles import LAYERS
from neumat.btf.synthesis.lattice import PARTS


class LatticePlane(EndlessPlane):
    """Positions in cells of a lattice."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.cells = synthesis.cells

    def texels(self, cells, fractions, shift=0.0):
        """Return texel coordinates as integers [Int64] and rests [Float64] in [0, 1)."""
        wholes, rests = [], []
        for cell, fraction, size in zip(cells, fractions, self.size, strict=True):
            texel = fraction * size + shift
            whole = dr.floor(texel)
            wholes.append(cell * size + mi.Int64(whole))
            rests.append(texel - whole)
        return wholes, rests

    def split(self, wholes, rests):
        """Return the cells i, j, Int64, and the places in them f, g, Float64, of texel coordinates."""
        (x, y), (rest_x, rest_y), cells = wholes, rests, self.cells
        i, f = self._split(cells.d * x - cells.c * y, cells.d * rest_x - cells.c * rest_y)
        j, g = self._split(cells.a * y - cells.b * x, cells.a * rest_y - cells.b * rest_x)
        return i, j, f, g

    def point(self, m, n):
        """Return the texel [Int64] nearest to m / 2 v + n / 2 w."""
        pairs = ((self.cells.a, self.cells.c), (self.cells.b, self.cells.d))
        return [_floor_divided(m * v + n * w + PARTS, 2 * PARTS) for v, w in pairs]

    def _split(self, whole, place):
        cell = _floor_divided(PARTS * whole, self.cells.area)
        place = (mi.Float64(PARTS * whole - cell * self.cells.area) + PARTS * place) / self.cells.area
        more = dr.floor(place)
        return cell + mi.Int64(more), place - more


class CornerPlane(LatticePlane):
    """Corner tiles; see `neumat.btf.synthesis.corner`."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.pyramid, self.base = Pyramid(synthesis.levels, synthesis.tileable), synthesis.base.tolist()
        self.steps, self.colours = synthesis.steps, synthesis.colours
        _, self.rows, self.columns = synthesis.layers.shape
        self.layers = mi.UInt32(synthesis.layers.flatten().numpy())
        self.anchors = mi.Int32(synthesis.anchors.flatten().numpy())
        self.first = mi.Int32(synthesis.first.flatten().numpy())

    def features(self, cells, fractions, level):
        wholes, rests = self.texels(cells, fractions, -0.5)
        i, j, f, g = self.split(wholes, rests)
        tile = mi.UInt32(0)
        for down in (0, 1):
            for right in (0, 1):
                tile = tile * self.colours + self.drawn(self.colours, [i + right, j + down])
        column, row = (
            mi.UInt32(dr.clip(dr.floor(place * steps + 0.5), 0, steps))
            for place, steps in zip((f, g), self.steps, strict=True)
        )
        layer = dr.gather(mi.UInt32, self.layers, (tile * self.rows + row) * self.columns + column)
        right, down = (mi.Int64(dr.gather(mi.Int32, self.anchors, 2 * layer + k)) for k in (0, 1))
        corners = self.point(2 * (i + right), 2 * (j + down))
        place = []
        for k, size in enumerate(self.size):
            first = dr.gather(mi.Int32, self.first, 2 * (tile * LAYERS + layer) + k)
            place.append(mi.Float((mi.Float64(first) + mi.Float64(wholes[k] - corners[k]) + rests[k] + 0.5) / size))
        return [v + base for v, base in zip(self.pyramid.fetch(*place, level), self.base, strict=True)]


class AutocovariancePlane(LatticePlane):
    """Two tilings blended as Gaussian variables; see `neumat.btf.synthesis.autocovariance`."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.gaussian = Gaussian(synthesis.gaussian)
        self.pyramid = self.gaussian.pyramid
        self.count = synthesis.draws.shape[1]
        self.draws = [mi.Int32(draws.flatten().numpy()) for draws in synthesis.draws]
        self.likeness = synthesis.likeness.tolist()

    def features(self, cells, fractions, level):
        wholes, rests = self.texels(cells, fractions)
        i, j, f, g = self.split(wholes, rests)
        middles = (
            (2 * i + 1, 2 * j + 1),
            tuple(2 * (cell + dr.select(x >= 0.5, mi.Int64(1), 0)) for cell, x in ((i, f), (j, g))),
        )
        positions = []
        for draws, middle in zip(self.draws, middles, strict=True):
            drawn = self.drawn(self.count, middle)
            at = self.point(*middle)
            positions.append(
                [
                    mi.Float(
                        (dr.gather(mi.Int32, draws, 2 * drawn + k) + mi.Float64(wholes[k] - at[k]) + rests[k]) / size
                    )
                    for k, size in enumerate(self.size)
                ]
            )
        f, g = dr.abs(f - 0.5), dr.abs(g - 0.5)
        first, second = 0.5 - dr.maximum(f, g), dr.minimum(f, g)
        share = mi.Float(first / (first + second + 1e-12))
        a, b = (dr.square(dr.square(each)) for each in (share, 1 - share))
        a = a / (a + b)
        b = 1 - a
        scale = [dr.rsqrt(a * a + b * b + 2 * a * b * alike) for alike in self.likeness]
        return self.gaussian.blend(level, positions, [a, b], scale)


def _floor_divided(x, divisor):
    """Return the floor of x / divisor, Int64; divisor > 0."""
    return (x - rest(x, divisor)) // divisor
