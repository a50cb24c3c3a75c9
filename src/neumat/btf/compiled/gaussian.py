"""Blending of Gaussian variables in Dr.Jit."""

import drjit as dr
import mitsuba as mi

from neumat.btf.compiled.planes import Pyramid
from neumat.btf.synthesis.gaussian import RANGE
from neumat.render.drjit_brdf import buffer


class Gaussian:
    """See `neumat.btf.synthesis.gaussian.GaussianPlane`."""

    def __init__(self, gaussian):
        self.pyramid = Pyramid(gaussian.levels, gaussian.wrap)
        self.entries, self.channels = gaussian.tables.shape[1:]
        self.tables = buffer(gaussian.tables)
        self.axes, self.base = gaussian.axes.tolist(), gaussian.base.tolist()
        self.low, self.high = buffer(gaussian.low), buffer(gaussian.high)

    def blend(self, level, positions, weights, scale=None):
        """Return features [Float] from the weighted sums of fetches, times `scale` [Float] where given."""
        sums = self.pyramid.blend(positions, weights, level)
        if scale is not None:
            sums = [total * factor for total, factor in zip(sums, scale, strict=True)]
        row = 0 if level is None else level * self.channels
        start = row * self.entries
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
            low, high = (dr.gather(mi.Float, bounds, mi.UInt32(row + k)) for bounds in (self.low, self.high))
            features.append(dr.clip(total, low, high))
        return features
