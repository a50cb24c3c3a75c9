"""Synthesis methods in Dr.Jit: the same features as `neumat.btf.synthesis`, from the same tensors.

A position is an integer cell and a fraction inside it; arithmetic on cells is exact.
"""

import drjit as dr
import mitsuba as mi

from neumat.btf.drjit_planes import Pyramid
from neumat.btf.hashing import MASK
from neumat.btf.synthesis.corner import Corner
from neumat.btf.synthesis.corner_tiles import LAYERS
from neumat.btf.synthesis.gaussian import RANGE
from neumat.btf.synthesis.histogram import Histogram
from neumat.btf.synthesis.lattice import PARTS
from neumat.btf.synthesis.linear import Linear
from neumat.btf.synthesis.tiling import Tiling
from neumat.errors import NeumatError
from neumat.render.drjit_brdf import buffer


def endless_plane(synthesis):
    """Return the endless plane in Dr.Jit of a fitted `Synthesis`. Raises NeumatError for methods that have none."""
    kinds = {Tiling: TilingPlane, Linear: LinearPlane, Histogram: HistogramPlane, Corner: CornerPlane}
    if type(synthesis) not in kinds:
        known = ", ".join(kind.__name__.lower() for kind in kinds)
        raise NeumatError("btf: synthesis", f"one of {known}", type(synthesis).__name__.lower())
    return kinds[type(synthesis)](synthesis)


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

    def hashed(self, cells):
        """Return the UInt32 of `hashed_integers` for cells [Int64]."""
        key = _mix((_mix((_mix(self.seed & MASK) + (self.seed >> 32)) & MASK)) & MASK)
        state = mi.UInt32(key)
        for cell in cells:
            state = _mixed(state + mi.UInt32(cell)) ^ key
        return state


class TilingPlane(EndlessPlane):
    """The exemplar repeated."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.pyramid, self.base = Pyramid(synthesis.levels, True), synthesis.base.tolist()

    def features(self, cells, fractions, level):
        place = [mi.Float(fraction) for fraction in fractions]
        return [x + base for x, base in zip(self.pyramid.fetch(*place, level), self.base, strict=True)]


class TrianglePlane(EndlessPlane):
    """Three patches over each position; see `neumat.btf.synthesis.triangles`."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.ranges = synthesis.grid.ranges

    def patches(self, cells, fractions):
        """Return positions [(x, y)] in the exemplar and barycentric weights [Float]; see `Grid.patches`."""
        x, y = 7 * fractions[0] - 4 * fractions[1], 4 * fractions[1]
        whole_x, whole_y = dr.floor(x), dr.floor(y)
        halves = 7 * cells[0] - 4 * cells[1] + mi.Int64(whole_x)
        column, row = halves >> 1, 4 * cells[1] + mi.Int64(whole_y)
        x, y = (mi.Float64(halves & 1) + (x - whole_x)) / 2, y - whole_y
        upper = x + y >= 1
        corner = dr.select(upper, mi.Int64(1), 0)
        weights = [dr.abs(1 - x - y), dr.select(upper, 1 - y, x), dr.select(upper, 1 - x, y)]
        positions = []
        for right, down in ((corner, corner), (mi.Int64(1), mi.Int64(0)), (mi.Int64(0), mi.Int64(1))):
            from_x, from_y = x - mi.Float64(right), y - mi.Float64(down)
            i, j = column + right, row + down
            draw = self.hashed([i, j])
            positions.append(
                (
                    self._place(0, (2 * from_x + from_y) / 7, 2 * i + j, 7, draw & 0xFFFF),
                    self._place(1, from_y / 4, j, 4, draw >> 16),
                )
            )
        return positions, [mi.Float(weight) for weight in weights]

    def _place(self, axis, offset, centre, parts, number):
        (first, count), size = self.ranges[axis], self.size[axis]
        rest = (centre * size) % parts
        rest = dr.select(rest < 0, rest + parts, rest)
        rest = dr.select(2 * rest > parts, rest - parts, rest)
        chosen = first + mi.Int64(mi.UInt64(number) * count >> 16)
        return mi.Float(offset + (mi.Float64(rest) / parts + mi.Float64(chosen)) / size)


class LinearPlane(TrianglePlane):
    """Patches blended by their barycentric weights."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.pyramid, self.base = Pyramid(synthesis.levels, synthesis.tileable), synthesis.base.tolist()

    def features(self, cells, fractions, level):
        blended = self.pyramid.blend(*self.patches(cells, fractions), level)
        return [x + base for x, base in zip(blended, self.base, strict=True)]


class HistogramPlane(TrianglePlane):
    """Patches blended as Gaussian variables."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.gaussian = Gaussian(synthesis.gaussian)
        self.pyramid = self.gaussian.pyramid

    def features(self, cells, fractions, level):
        positions, weights = self.patches(cells, fractions)
        weights = [weight * weight for weight in weights]
        weights = [weight * weight * weight for weight in weights]
        norm = dr.rsqrt(sum(weight * weight for weight in weights))
        return self.gaussian.blend(level, positions, [weight * norm for weight in weights])


class Gaussian:
    """See `neumat.btf.synthesis.gaussian.GaussianPlane`."""

    def __init__(self, gaussian):
        self.pyramid = Pyramid(gaussian.levels, gaussian.wrap)
        self.entries, self.channels = gaussian.tables.shape[1:]
        self.tables = buffer(gaussian.tables)
        self.axes, self.base = gaussian.axes.tolist(), gaussian.base.tolist()
        self.low, self.high = gaussian.low.tolist(), gaussian.high.tolist()

    def blend(self, level, positions, weights):
        """Return features [Float] from the weighted sum of fetches."""
        sums = self.pyramid.blend(positions, weights, level)
        start = 0 if level is None else level * (self.entries * self.channels)
        values = []
        for k, value in enumerate(sums):
            x = dr.clip((value + RANGE) * ((self.entries - 1) / (2 * RANGE)), 0.0, self.entries - 1.0)
            first = dr.minimum(mi.UInt32(x), self.entries - 2)
            index = start + first * self.channels + k
            lower, upper = (dr.gather(mi.Float, self.tables, at) for at in (index, index + self.channels))
            values.append(dr.lerp(lower, upper, x - mi.Float(first)))
        features = []
        for k, base in enumerate(self.base):
            total = mi.Float(base)
            for value, axis in zip(values, self.axes, strict=True):
                total = dr.fma(value, axis[k], total)
            features.append(dr.clip(total, self.low[k], self.high[k]))
        return features


class CornerPlane(EndlessPlane):
    """Corner tiles; see `neumat.btf.synthesis.corner`."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.pyramid, self.base = Pyramid(synthesis.levels, synthesis.tileable), synthesis.base.tolist()
        self.cells, self.steps, self.colours = synthesis.cells, synthesis.steps, synthesis.colours
        _, self.rows, self.columns = synthesis.layers.shape
        self.layers = mi.UInt32(synthesis.layers.flatten().numpy())
        self.anchors = mi.Int32(synthesis.anchors.flatten().numpy())
        self.first = mi.Int32(synthesis.first.flatten().numpy())

    def features(self, cells, fractions, level):
        (x, rest_x), (y, rest_y) = (
            _whole_and_rest(cell, fraction, size) for cell, fraction, size in
            zip(cells, fractions, self.size, strict=True)
        )  # fmt: skip
        grid = self.cells
        i, f = self._split(grid.d * x - grid.c * y, grid.d * rest_x - grid.c * rest_y)
        j, g = self._split(grid.a * y - grid.b * x, grid.a * rest_y - grid.b * rest_x)
        tile = mi.UInt32(0)
        for down in (0, 1):
            for right in (0, 1):
                draw = self.hashed([i + right, j + down])
                tile = tile * self.colours + mi.UInt32(mi.UInt64(draw) * self.colours >> 32)
        column, row = (
            mi.UInt32(dr.clip(dr.floor(place * steps + 0.5), 0, steps))
            for place, steps in zip((f, g), self.steps, strict=True)
        )
        layer = dr.gather(mi.UInt32, self.layers, (tile * self.rows + row) * self.columns + column)
        anchor = [mi.Int64(dr.gather(mi.Int32, self.anchors, 2 * layer + k)) for k in (0, 1)]
        corners = self._point(2 * (i + anchor[0]), 2 * (j + anchor[1]))
        texel = 2 * (tile * LAYERS + layer)
        place = []
        for k, (whole, rest, size) in enumerate(zip((x, y), (rest_x, rest_y), self.size, strict=True)):
            first = dr.gather(mi.Int32, self.first, texel + k)
            place.append(mi.Float((mi.Float64(first) + mi.Float64(whole - corners[k]) + rest + 0.5) / size))
        return [v + base for v, base in zip(self.pyramid.fetch(*place, level), self.base, strict=True)]

    def _split(self, whole, rest):
        cell = _floor_divided(PARTS * whole, self.cells.area)
        place = (mi.Float64(PARTS * whole - cell * self.cells.area) + PARTS * rest) / self.cells.area
        more = dr.floor(place)
        return cell + mi.Int64(more), place - more

    def _point(self, m, n):
        pairs = ((self.cells.a, self.cells.c), (self.cells.b, self.cells.d))
        return [_floor_divided(m * v + n * w + PARTS, 2 * PARTS) for v, w in pairs]


def _whole_and_rest(cell, fraction, size):
    """Return `cell` + `fraction` times `size` minus a half, as integers and rests in [0, 1)."""
    texel = fraction * size - 0.5
    whole = dr.floor(texel)
    return cell * size + mi.Int64(whole), texel - whole


def _floor_divided(x, divisor):
    """Return the floor of x / divisor, Int64; divisor > 0."""
    return (x - _rest(x, divisor)) // divisor


def _rest(x, divisor):
    rest = x % divisor
    return dr.select(rest < 0, rest + divisor, rest)


def _mix(x):
    """See `neumat.btf.hashing`; of an integer."""
    x = (x ^ (x >> 16)) * 0x7FEB352D & MASK
    x = (x ^ (x >> 15)) * 0x846CA68B & MASK
    return x ^ (x >> 16)


def _mixed(x):
    """The same of a UInt32, whose products keep their low 32 bits."""
    x = (x ^ (x >> 16)) * 0x7FEB352D
    x = (x ^ (x >> 15)) * 0x846CA68B
    return x ^ (x >> 16)
