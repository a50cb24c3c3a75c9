"""Three patches over each position, blended; see `neumat.btf.synthesis.triangles`."""

import drjit as dr
import mitsuba as mi

from neumat.btf.compiled.endless import EndlessPlane, rest
from neumat.btf.compiled.gaussian import Gaussian
from neumat.btf.compiled.planes import Pyramid
from neumat.btf.synthesis.hex import CONTRAST


class TrianglePlane(EndlessPlane):
    """The patches; subclasses blend them."""

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
        beside = rest(centre * size, parts)
        beside = dr.select(2 * beside > parts, beside - parts, beside)
        chosen = first + mi.Int64(mi.UInt64(number) * count >> 16)
        return mi.Float(offset + (mi.Float64(beside) / parts + mi.Float64(chosen)) / size)


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


class HexPlane(TrianglePlane):
    """Patches with sharpened weights, in which brighter texels count more."""

    def __init__(self, synthesis):
        super().__init__(synthesis)
        self.pyramid, self.base = Pyramid(synthesis.levels, synthesis.tileable), synthesis.base.tolist()

    def features(self, cells, fractions, level):
        positions, weights = self.patches(cells, fractions)
        patches = [self.pyramid.fetch(*position, level) for position in positions]
        squares = [weight * weight for weight in weights]
        shares = [
            square * square * square * weight * (1 - CONTRAST + CONTRAST * patch[-1])
            for square, weight, patch in zip(squares, weights, patches, strict=True)
        ]
        total = sum(shares)
        return [
            sum(share * patch[k] for share, patch in zip(shares, patches, strict=True)) / total + base
            for k, base in enumerate(self.base)
        ]
