"""Fields, tables and sampling densities in Dr.Jit, for the BSDF plugins of `mitsuba_bsdf`.

Everything works on the variant of Mitsuba that is set: on arrays in compiled variants, on numbers in scalar ones, where
both branches of a select run and so none may divide by 0. Directions are unit vectors, the normal is z.
"""

import math
from itertools import pairwise

import drjit as dr
import mitsuba as mi
import numpy as np

from neumat.brdf.coordinates import GRID
from neumat.fields.field import LARGEST_LOG
from neumat.fields.layout import WIDTHS
from neumat.render.lobes import ALPHAS, ANGLES

TINY = 1e-7


def buffer(values):
    """Return a one-dimensional array in memory, not a constant of the kernel, of numbers of any shape."""
    flat = np.ascontiguousarray(values, np.float32).ravel()
    return (mi.Float if dr.is_jit_v(mi.Float) else mi.ArrayXf)(flat)


def called(function, active, *arguments):
    """Return function(*arguments), where `active`.

    In compiled variants the function stays one of its own in the kernel: a field's thousand operations would else be
    compiled again at each place from where a BSDF or a blend of some evaluates one, up to a minute for a scene.
    """
    if dr.is_jit_v(mi.Float):
        return dr.switch(mi.UInt32(0), [lambda *given, active: function(*given)], *arguments, active=active)
    return function(*arguments)


def _read4(source, index):
    """Return the four numbers from 4 * index on."""
    if dr.is_jit_v(mi.Float):
        return dr.gather(mi.Vector4f, source, index)
    return mi.Vector4f([source[4 * index + k] for k in range(4)])


def half_difference(wi, wo):
    """Return (sin theta_h, cos theta_h) and the difference vector (x, y, z) with phi_d in [0, pi).

    As neumat.brdf.coordinates; swapping wi and wo changes nothing, to the last bit.
    """
    both, d = wi + wo, 0.5 * (wi - wo)
    extent = dr.maximum(dr.norm(both), TINY)
    h = both / extent
    sin_h = dr.sqrt(h.x * h.x + h.y * h.y)
    safe = sin_h > TINY
    cos_p = dr.select(safe, h.x / dr.maximum(sin_h, TINY), 1.0)
    sin_p = dr.select(safe, h.y / dr.maximum(sin_h, TINY), 0.0)
    x = h.z * (cos_p * d.x + sin_p * d.y) - sin_h * d.z
    y = cos_p * d.y - sin_p * d.x
    side = dr.select((y < 0) | ((y == 0) & (x < 0)), -1.0, 1.0)
    return sin_h, h.z, (side * x, side * y, 0.5 * extent)


def field_value(weights, wi, wo, widths=WIDTHS):
    """Return f, a Color3f, 1/sr, of a field whose numbers are in the buffer `weights`."""
    sin_h, cos_h, d = half_difference(wi, wo)
    layer = _layer
    if not dr.is_jit_v(mi.Float):
        layer, weights = _scalar_layer, np.array(weights)
    values, at = [sin_h, 0.0, cos_h, *d], 0  # the second component of the half vector is always 0
    for n, m in pairwise(widths):
        sums = layer(weights, at, n, m, values)
        values = [dr.maximum(value, 0.0) for value in sums]
        at += (n + 1) * m
    return mi.Color3f(*(dr.maximum(dr.exp(dr.minimum(value, LARGEST_LOG)) - 1, 0.0) for value in sums))


def _layer(weights, at, n, m, values):
    """Return the m sums of a layer with n inputs, whose kernel and biases begin at the weight `at`."""

    def read(k):
        return dr.gather(mi.Float, weights, mi.UInt32(at + k))

    sums = [read(n * m + j) for j in range(m)]
    for i, value in enumerate(values):
        if not isinstance(value, float):
            sums = [dr.fma(read(i * m + j), value, total) for j, total in enumerate(sums)]
    return sums


def _scalar_layer(weights, at, n, m, values):
    """Return what `_layer` does; in scalar variants, where NumPy takes a third of a picture's time."""
    kernel, bias = weights[at : at + n * m].reshape(n, m), weights[at + n * m : at + (n + 1) * m]
    return (np.array(values) @ kernel + bias).tolist()


def table_value(table, wi, wo, number=0):
    """Return f, a Color3f, 1/sr, of a table on the MERL grid in the buffer `table`: R, G, B, and 1 if valid else 0.

    number: of the table, where the buffer holds several. Trilinear, as neumat.brdf.table.Table: where some of the 8
    neighbours are invalid, the others share their weight.
    """
    sin_h, cos_h, (x, y, z) = half_difference(wi, wo)
    n_h, n_d, n_p = GRID
    theta_h, theta_d = dr.atan2(sin_h, cos_h), dr.atan2(dr.sqrt(x * x + y * y), z)
    h = dr.minimum(dr.sqrt(theta_h * (2 / math.pi)) * n_h, n_h - 1)
    d = dr.minimum(theta_d * (2 / math.pi) * n_d, n_d - 1)
    p = dr.atan2(y, x) * (n_p / math.pi)
    low_h, low_d, low_p = (
        mi.UInt32(dr.minimum(axis, last)) for axis, last in ((h, n_h - 2), (d, n_d - 2), (p, n_p - 1))
    )
    share_h, share_d, share_p = (axis - mi.Float(low) for axis, low in ((h, low_h), (d, low_d), (p, low_p)))
    high_p = dr.select(low_p == n_p - 1, 0, low_p + 1)  # phi_d wraps at pi by reciprocity
    total = mi.Vector4f(0.0)
    for i, part_h in ((low_h, 1 - share_h), (low_h + 1, share_h)):
        for j, part_d in ((low_d, 1 - share_d), (low_d + 1, share_d)):
            for k, part_p in ((low_p, 1 - share_p), (high_p, share_p)):
                total += part_h * part_d * part_p * _read4(table, ((number * n_h + i) * n_d + j) * n_p + k)
    return mi.Color3f(total.x, total.y, total.z) / dr.maximum(total.w, 1e-6)


def _shares(lobes, wi, number):
    """Return the shares of the GGX lobes, a Vector4f, for the view wi; number: of the material in the buffer."""
    at = dr.clip(dr.acos(dr.clip(wi.z, 0.0, 1.0)) * (2 / math.pi) * ANGLES - 0.5, 0.0, ANGLES - 1.0)
    low = mi.UInt32(dr.minimum(at, ANGLES - 2))
    first = number * ANGLES + low
    return dr.lerp(_read4(lobes, first), _read4(lobes, first + 1), at - mi.Float(low))


def lobes_density(lobes, wi, wo, number=0):
    """Return the density, 1/sr, of `lobes_sample`; see neumat.render.quadrature.ggx_density."""
    shares = _shares(lobes, wi, number)
    both = wi + wo
    h = both / dr.maximum(dr.norm(both), TINY)
    sine2 = h.x * h.x + h.y * h.y
    slant2 = wi.x * wi.x + wi.y * wi.y
    total = (1 - dr.sum(shares)) * wo.z / math.pi
    for k, alpha in enumerate(ALPHAS):
        a2 = alpha * alpha
        stretched = sine2 + a2 * h.z * h.z
        normals = a2 / (math.pi * stretched * stretched)
        total += shares[k] * normals / (2 * (wi.z + dr.sqrt(wi.z * wi.z + a2 * slant2)))
    return total


def lobes_sample(lobes, wi, sample, number=0):
    """Return a direction for the view wi, from a point of the unit square; see neumat.render.quadrature.ggx_lobe.

    The point's first coordinate also picks the lobe: points that are spread evenly give each lobe its share of them,
    and within a lobe they are still spread evenly.
    """
    shares = _shares(lobes, wi, number)
    start, share, alpha = mi.Float(0.0), shares[0], mi.Float(ALPHAS[0])
    for k in range(1, len(ALPHAS)):
        within = sample.x >= start + share
        start, share, alpha = (
            dr.select(within, *pair) for pair in ((start + share, start), (shares[k], share), (ALPHAS[k], alpha))
        )
    diffuse = sample.x >= start + share
    start, share = dr.select(diffuse, start + share, start), dr.select(diffuse, 1 - start - share, share)
    x = dr.clip((sample.x - start) / dr.maximum(share, TINY), 0.0, 1.0)
    stretch = mi.Vector3f(alpha, alpha, 1.0)
    standard = dr.normalize(wi * stretch)
    azimuth = 2 * math.pi * sample.y
    z = (1 - x) * (1 + standard.z) - standard.z
    sine = dr.safe_sqrt(1 - z * z)
    cap = mi.Vector3f(sine * dr.cos(azimuth), sine * dr.sin(azimuth), z)
    h = dr.normalize((cap + standard) * stretch)
    cosine_lobe = mi.warp.square_to_cosine_hemisphere(mi.Point2f(x, sample.y))
    return dr.select(diffuse, cosine_lobe, mi.reflect(wi, h))
