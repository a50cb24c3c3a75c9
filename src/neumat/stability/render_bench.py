"""What the BSDF plugins are stressed on, and how their answers are measured, in compiled and scalar variants."""

import math
from typing import NamedTuple

import numpy as np
import torch
from torch.nn.functional import normalize

from neumat.brdf.coordinates import rusinkiewicz
from neumat.brdf.merl import read_merl
from neumat.brdf.table import Table
from neumat.fields.field import Field, highlights
from neumat.fields.layout import SIZE, unpack
from neumat.render import scene
from neumat.render.mitsuba_scene import bsdf, mitsuba, render_bsdf
from neumat.render.quadrature import hemisphere
from neumat.render.sphere import FrozenSphere
from neumat.seeds import torch_generator

QUERIES, DRAWN = 1_000_000, 1 << 15  # pairs of directions in all; directions drawn for one view
SCALAR_QUERIES, SCALAR_DRAWN = 2000, 256  # at Python's speed
MATERIALS = 8  # from matte to mirror
UNBIASED = 0.02  # relative error of the light reflected, beside 4 standard errors of what was drawn
CLOSE = 1e-3  # |f - f'| / (1 + f): a mirror's highlight is so narrow that rounding shows
SEAM = 1e-3  # sine of phi_d, below which rounding may pick the other side of the jump in the plane of incidence


class Drawn(NamedTuple):
    """share: of the light that drawn directions reflect, of the brightest channel; error: relative, its largest of the
    channels, against the quadrature; spread: relative standard deviation of one direction's weight; right: whether the
    error is noise, all is finite, and each weight times its density is the value in that direction."""

    share: float
    error: float
    spread: float
    right: bool


class RenderBench:
    """Fields and the measured tables that they were fitted to, and what Mitsuba and Dr.Jit make of them.

    names (n,), weights (n, 675), store: an AugMerl; indices (n,): the store's materials. folder: for files, a Path.
    queries: pairs of directions of the largest comparisons, at most; scalar variants are too slow for many.
    Attributes: materials {name: weights (675,)}, MATERIALS of them, from the darkest highlight to the brightest.
    """

    def __init__(self, names, weights, store, indices, folder, seed, queries=QUERIES):
        self.mi = mitsuba()
        import drjit as dr  # after mitsuba() has found the LLVM library that it loads

        self.dr, self.compiled = dr, dr.is_jit_v(self.mi.Float)
        self.queries = min(queries, QUERIES if self.compiled else SCALAR_QUERIES)
        self.draws = min(self.queries, DRAWN if self.compiled else SCALAR_DRAWN)
        self.size, self.spp = (32, 16) if self.compiled else (8, 4)
        self.noise = 0.05 if self.compiled else 0.3  # of the mean of a picture
        self.names, self.weights, self.store, self.indices = names, weights, store, indices
        self.folder, self.seed = folder, seed
        self.frozen = FrozenSphere(self.size, rings=32, azimuths=64)
        chosen = (
            highlights(weights)
            .argsort()[torch.linspace(0, len(names) - 1, MATERIALS).round().long()]
            .unique_consecutive()
        )
        self.materials = {names[i]: weights[i] for i in chosen}
        self.matte, *_, self.mirror = self.materials
        self._tables = {}

    def load(self, plugin):
        """Return the plugin of a Mitsuba dictionary or of weights (675,)."""
        from neumat.render.mitsuba_bsdf import load_dict

        return load_dict(plugin if isinstance(plugin, dict) else bsdf(plugin))

    def table(self, name):
        """Return (path, Table) of the measured material `name`, written as a MERL file."""
        if name not in self._tables:
            path = self.folder / f"{name}.binary"
            self.store.materialise(self.indices[self.names.index(name)], path)
            self._tables[name] = path, Table(read_merl(path))
        return self._tables[name]

    def both(self, name, kind):
        """Return the plugin and the material, weights (675,) or Table, of the "field" or "table" `name`."""
        if kind == "field":
            return self.load(self.materials[name]), self.materials[name]
        path, table = self.table(name)
        return self.load({"type": "merl", "filename": str(path)}), table

    def picture(self, plugin, environment=scene.environment):
        """Return Mitsuba's linear picture (size, size, 3) of a Mitsuba dictionary or of weights (675,)."""
        plugin = plugin if isinstance(plugin, dict) else bsdf(plugin)
        return torch.from_numpy(render_bsdf(plugin, self.size, self.spp, environment))

    def evaluate(self, plugin, wi, wo):
        """Return f cos(theta_o) (n, 3) and the density (n,) at directions (n, 3)."""
        context = self.mi.BSDFContext()
        value, density = self._each(lambda si, wo: plugin.eval_pdf(context, si, self.mi.Vector3f(wo)), wi, wo)
        return value, density[:, 0]

    def reflectance(self, plugin, wi, wo):
        """Return f (n, 3) of a plugin of ours, 1/sr, without the cosine and at any direction."""
        return self._each(lambda si, wo: (plugin.value(si.wi, self.mi.Vector3f(wo)),), wi, wo)[0]

    def draw(self, plugin, wi, points):
        """Return drawn directions (n, 3), their density (n,), weight (n, 3), of points (n, 2) of the unit square."""
        context = self.mi.BSDFContext()

        def one(si, point):
            drawn, weight = plugin.sample(context, si, 0.5, self.mi.Point2f(point))
            return drawn.wo, drawn.pdf, weight

        wo, density, weight = self._each(one, wi, points)
        return wo, density[:, 0], weight

    def _each(self, function, wi, other):
        """Return the results (n, k) of function(interaction, numbers): of arrays at once, or one by one."""
        mi, wi, other = self.mi, wi.float().numpy(), other.float().numpy()
        if not self.compiled:
            rows = []
            for view, numbers in zip(wi.tolist(), other.tolist(), strict=True):
                si = mi.SurfaceInteraction3f()
                si.wi = mi.Vector3f(view)
                rows.append([np.array(result, np.float32).ravel() for result in function(si, numbers)])
            return [torch.from_numpy(np.stack(column)) for column in zip(*rows, strict=True)]
        si = self.dr.zeros(mi.SurfaceInteraction3f)
        si.wi = mi.Vector3f(wi.T)
        arrays = (np.atleast_2d(np.array(result)) for result in function(si, other.T))
        return [torch.from_numpy(np.broadcast_to(a, (len(a), len(wi))).T.copy()) for a in arrays]

    def drawn(self, plugin, material, theta, expected=None, least=0):
        """Return the Drawn of a view at `theta` degrees.

        expected: share (3,) of the light reflected, if known; least: number of directions drawn.
        """
        count = max(self.draws, least)
        wi = self.pairs(f"drawn at {theta}", count, theta)[0]
        wo, density, weight = self.draw(plugin, wi, self.points("drawn", count))
        value, again = self.evaluate(plugin, wi, wo)
        consistent = torch.equal(density, again) and float(deviation(weight * density[:, None], value).max()) < 1e-5
        weight = weight.double()
        share, spread = weight.mean(0), weight.std(0)
        expected = albedo(material, theta) if expected is None else expected
        error = (share - expected).abs()
        unbiased = error <= UNBIASED * expected + 4 * spread / math.sqrt(count) + 1e-6
        return Drawn(
            share.max().item(),
            (error / expected.clamp_min(1e-9)).max().item(),
            (spread / expected.clamp_min(1e-9)).max().item(),
            consistent and finite(wo, density, weight) and bool(unbiased.all()),
        )

    def pairs(self, name, count, theta=None):
        """Return unit directions (wi, wo), (n, 3), above the horizon, half of wo about the mirror direction of wi.

        name: seeds them. theta: polar angle of wi, in degrees; None anywhere.
        """
        wi, wo, noise = torch.randn(3, count, 3, generator=torch_generator(self.seed, name), dtype=torch.float64)
        wi[:, 2].abs_().clamp_min_(1e-3)
        if theta is not None:
            polar = math.radians(theta)
            wi = torch.cat([normalize(wi[:, :2]) * math.sin(polar), torch.full((count, 1), math.cos(polar))], 1)
        wi = normalize(wi)
        wo[: count // 2] = (wi * wi.new_tensor([-1, -1, 1]) + 0.02 * noise)[: count // 2]
        # So near the horizon that rounding would decide whether there is light, there is none here.
        wo[:, 2].abs_().clamp_min_(1e-3)
        return wi.float(), normalize(wo).float()

    def points(self, name, count):
        """Return random points (n, 2) of the unit square."""
        return torch.rand(count, 2, generator=torch_generator(self.seed, name))


def reference(material, wi, wo):
    """Return `material_at` and the angles (theta_h, theta_d, phi_d) of unit directions (n, 3)."""
    angles = rusinkiewicz(wo.double(), wi.double())
    return material_at(material, *angles), angles


def material_at(material, *angles):
    """Return f (n, 3) of a field (675,), in double precision, or of a Table at angles (n,), float64."""
    return (material if isinstance(material, Table) else Field(material.double())).eval(*angles).double()


def off_seam(angles):
    """Return where phi_d is not next to the plane of incidence, bool (n,)."""
    return angles[2].sin().abs() > SEAM


def deviation(found, expected):
    """Return |found - expected| / (1 + expected), the largest of the channels, (n,); NaN counts as infinite."""
    return ((found - expected).abs() / (1 + expected)).amax(1).nan_to_num(math.inf)


def numbers(values):
    """Return in words some numbers (n,)."""
    return ", ".join(f"{value:.4g}" for value in values.tolist())


def finite(*tensors):
    """Return whether all numbers of all tensors are finite."""
    return all(bool(tensor.isfinite().all()) for tensor in tensors)


def degrees(angles, at):
    """Return in words where the query `at` lies."""
    theta_h, theta_d, phi_d = (math.degrees(angle[at]) for angle in angles)
    return f"theta_h {theta_h:.3g}, theta_d {theta_d:.3g}, phi_d {phi_d:.3g} degrees"


def albedo(material, theta):
    """Return the share (3,) of light from `theta`, in degrees, that a field (675,) or Table reflects."""
    light, view, weight = hemisphere(torch.tensor([math.radians(theta)], dtype=torch.float64))
    up = weight[0] > 0
    wi = view.expand_as(light[0])[up]
    return (reference(material, wi, light[0][up])[0] * weight[0][up, None]).sum(0)


def constant(value):
    """Return the field (675,) that is `value`, 1/sr, everywhere."""
    return highlight(value, 0.0, 0.0)


def highlight(value, peak, fall):
    """Return a field (675,): log(1 + f) is that of `value` and a highlight of `peak`, both 1/sr, that falls linearly by
    `fall` times sin theta_h."""
    weights = torch.zeros(SIZE)
    (w1, b1), (w2, _), (w3, b3) = unpack(weights)
    b3[:] = math.log1p(value)
    w1[0, 0], b1[0], w2[0, 0], w3[0] = -fall, math.log1p(peak), 1.0, 1.0
    return weights


def scaled(weights, factor):
    """Return the field (675,) whose log(1 + f) is `factor` times that of `weights`: for dark ones, f itself."""
    result = weights.clone()
    kernel, bias = unpack(result)[-1]
    kernel *= factor
    bias *= factor
    return result
