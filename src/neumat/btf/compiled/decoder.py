"""Neural representations in Dr.Jit: from features of a position and two directions to values."""

import math

import drjit as dr
import mitsuba as mi
from drjit import nn

from neumat.btf.compiled.planes import padded, read
from neumat.btf.representations.variants import Biplane, Mean, NeuMip, Ours, TriplePlane
from neumat.errors import NeumatError
from neumat.render.drjit_brdf import TINY, buffer

MULTIPLE = 8  # of which cooperative vectors take as many numbers


class Decoder:
    """The planes of directions and the network of a fitted `Neural` representation.

    half: whether the network computes in 16 bits, which is all that it can on CUDA.
    Raises NeumatError for a representation of another kind.
    """

    def __init__(self, representation, half=False):
        kinds = {Ours: _ours, Mean: _ours, TriplePlane: _triple_plane, Biplane: _biplane, NeuMip: _neumip}
        if type(representation) not in kinds:
            known = ", ".join(kind.__name__ for kind in kinds)
            raise NeumatError("btf", f"a representation with a network: {known}", type(representation).__name__)
        self.parametrise = kinds[type(representation)]
        self.side, self.features = representation.side, representation.features
        self.planes = [buffer(padded(plane.flatten(0, 1))) for plane in representation.directional()]
        self.exposure, self.curve, self.ceiling = representation.state["encoding"].tolist()
        layers = representation.layers()
        self.number, tensor = (mi.Float16, mi.TensorXf16) if half else (mi.Float, mi.TensorXf)
        self.channels, inputs = representation.channels, layers[0].shape[1]
        self.zeros = _up(inputs) - inputs
        matrices = []
        for layer in layers:
            rows = layer.new_zeros(_up(len(layer)), _up(layer.shape[1]))
            rows[: len(layer), : layer.shape[1]] = layer
            matrices.append(tensor(rows.numpy()))
        self.matrices = nn.pack(*matrices, layout="inference")

    def value(self, features, light, view):
        """Return the value, a Color3f, 1/sr, for features [Float] and unit vectors; 0 at or below the horizon."""
        above = (light.z > 0) & (view.z > 0)
        positions, extras = self.parametrise(light, view)
        inputs = list(features[: self.channels])
        for plane, (x, y) in zip(self.planes, positions, strict=True):
            inputs += self._nodes(plane, x, y)
        vector = nn.CoopVec([self.number(each) for each in (*inputs, *extras, *[mi.Float(0.0)] * self.zeros)])
        for matrix in self.matrices[:-1]:
            vector = dr.maximum(nn.matvec(matrix, vector), 0)
        encoded = list(nn.matvec(self.matrices[-1], vector))[:3]
        return dr.select(above, mi.Color3f(*(self._decoded(mi.Float(each)) for each in encoded)), 0.0)

    def _decoded(self, encoded):
        """See `Encoding.decode`."""
        cut = dr.maximum(encoded, 0.0)
        if math.isfinite(self.ceiling):
            cut = dr.minimum(cut, self.ceiling)
        if self.curve:
            cut = (dr.exp(cut * math.log1p(self.curve)) - 1) / self.curve
        return cut / self.exposure

    def _nodes(self, plane, x, y):
        """Return the features [Float] of a plane of directions, whose outermost nodes are on the square's border."""
        last = self.side - 1
        x, y = (dr.clip(each, 0.0, 1.0) * last for each in (x, y))
        column, row = (mi.UInt32(dr.minimum(dr.floor(each), last - 1)) for each in (x, y))
        x, y = x - mi.Float(column), y - mi.Float(row)
        corner = row * self.side + column
        total = [mi.Float(0.0)] * self.features
        for index, weight in (
            (corner, (1 - x) * (1 - y)),
            (corner + 1, x * (1 - y)),
            (corner + self.side, (1 - x) * y),
            (corner + self.side + 1, x * y),
        ):
            total = [dr.fma(weight, value, sum_) for value, sum_ in
                     zip(read(plane, index, self.features), total, strict=True)]  # fmt: skip
        return total


def _up(count):
    return -(-count // MULTIPLE) * MULTIPLE


# What each representation's network is given: [position on each plane of directions], [extra inputs], of light and
# view. The same as `parametrise` of the representations, where the sources are named.


def _ours(light, view):
    h, d = _half_difference(light, view)
    return [_concentric_square(h), _concentric_square(d)], [*light, *view, mi.Float(1.0)]


def _triple_plane(light, view):
    theta_h, phi_h, theta_d, phi_d = _paper_half_difference(light, view)
    polar, turn = 2 / math.pi, 0.5 / math.pi
    return [(theta_h * polar, phi_h * turn + 0.5), (theta_d * polar, phi_d * turn + 0.5)], []


def _biplane(light, view):
    h, d = _half_difference(light, view)
    return [(h.x / 2 + 0.5, h.y / 2 + 0.5)], [d.x, d.y]


def _neumip(light, view):
    return [], [light.x, light.y, view.x, view.y]


def _half(light, view):
    total = light + view
    length = dr.norm(total)
    return dr.select(length > 1e-6, total / dr.maximum(length, 1e-6), mi.Vector3f(0, 0, 1))


def _half_difference(light, view):
    h = _half(light, view)
    side = (h.x * light.x + h.y * light.y) / dr.maximum(1 + h.z, 1e-6) + light.z
    return h, mi.Vector3f(light.x - h.x * side, light.y - h.y * side, dr.dot(h, light))


def _paper_half_difference(light, view):
    h = _half(light, view)
    sin_h = dr.sqrt(h.x * h.x + h.y * h.y)
    tilted = sin_h > TINY
    cos_p = dr.select(tilted, h.x / dr.maximum(sin_h, TINY), 1.0)
    sin_p = dr.select(tilted, h.y / dr.maximum(sin_h, TINY), 0.0)
    along, across = cos_p * light.x + sin_p * light.y, cos_p * light.y - sin_p * light.x
    dx, dz = h.z * along - sin_h * light.z, sin_h * along + h.z * light.z
    polar = dr.atan2(dr.sqrt(dx * dx + across * across), dz)
    return dr.atan2(sin_h, h.z), dr.atan2(sin_p, cos_p), polar, dr.atan2(across, dx)


def _concentric_square(direction):
    """See `neumat.btf.directions.concentric_square`."""
    slant = dr.sqrt(direction.x * direction.x + direction.y * direction.y)
    radius = dr.minimum(dr.atan2(slant, direction.z) * (2 / math.pi), 1.0)
    wide = dr.abs(direction.x) >= dr.abs(direction.y)
    longer, shorter = (dr.select(wide, *pair) for pair in
                       ((direction.x, direction.y), (direction.y, direction.x)))  # fmt: skip
    first = dr.select(longer < 0, -radius, radius)
    second = first * dr.atan(shorter / dr.select(longer == 0, 1.0, longer)) * (4 / math.pi)
    return dr.select(wide, first, second) / 2 + 0.5, dr.select(wide, second, first) / 2 + 0.5
