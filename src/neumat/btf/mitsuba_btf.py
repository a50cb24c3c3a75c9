"""Endless BTFs as a BSDF plugin of Mitsuba 3: importing this module registers it.

`btf`: a fitted representation with a network, synthesised at every query.
    filename: a file that `Representation.save` wrote; found as Mitsuba finds files
    synthesis: one of `neumat.btf.synthesis.SYNTHESES`; default "histogram"
    seed: of the choices of synthesis, an integer; default 0
    tileable: whether the exemplar's opposite borders match; default false
    scale: side of an exemplar, in units of uv; default 1
    level: of detail, the binary logarithm of the texels under a pixel, for all queries; by default that of the ray's
        footprint where the integrator traces ray differentials, else 0
    sampler, lobes, conserve: as of `nbrdf`, fitted to directions of random texels

    mi.load_dict({"type": "btf", "filename": "leather.safetensors", "scale": 0.25})

Scalar variants are slow: they evaluate each query by PyTorch. x and y of directions are those of u and v. BTFs are not
reciprocal: the light's direction is `wo` where radiance is transported, and `wi` where importance is. The planes of
positions, `plane` of `mi.traverse`, are differentiable.
"""

import math
import sys

from neumat.render.variant import variant

if "drjit" not in sys.modules:
    variant()  # finds the LLVM library that Dr.Jit loads at import

import drjit as dr
import mitsuba as mi
import torch

from neumat.brdf.coordinates import directions
from neumat.btf.compiled.decoder import Decoder
from neumat.btf.compiled.registry import endless_plane
from neumat.btf.endless import endless
from neumat.btf.representations.registry import load_representation
from neumat.btf.synthesis import SYNTHESES
from neumat.errors import NeumatError
from neumat.render.drjit_brdf import called
from neumat.render.mitsuba_material import material_class, serve
from neumat.render.plugin_properties import flag, path_of
from neumat.seeds import torch_generator

PLUGIN = "btf"
NEEDS_DIFFERENTIALS = 0x20000  # of BSDFFlags in C++, which Python has no name for


class AnyTexel:
    """The BRDF of a BTF seen at a texel and an azimuth that are drawn anew for each value.

    Its squares have the mean of all texels' squares, which is what directions should be drawn by.
    """

    def __init__(self, representation):
        self.representation, self.generator = representation, torch_generator(0, "any texel")
        self.plane = representation.positional().flatten(0, 1)

    def eval(self, theta_h, theta_d, phi_d):
        """Return f (n, 3), 1/sr, without the cosine of the light."""
        azimuth = torch.rand(len(theta_h), generator=self.generator) * (2 * math.pi)
        light, view = (_turned(each, azimuth).float() for each in directions(theta_h, theta_d, phi_d))
        texel = torch.randint(len(self.plane), (len(theta_h),), generator=self.generator)
        return self.representation.eval(self.plane[texel], light, view) / light[:, 2:].clamp_min(1e-3)


def _turned(direction, azimuth):
    x, y, z = direction.unbind(-1)
    cosine, sine = torch.cos(azimuth), torch.sin(azimuth)
    return torch.stack([cosine * x - sine * y, sine * x + cosine * y, z], -1)


def _classes():
    """Return the plugin {name: constructor} for the variant that is set."""

    class Btf(material_class()):
        def __init__(self, properties):
            representation = load_representation(path_of(properties, PLUGIN))
            name = properties.get("synthesis", "histogram")
            if name not in SYNTHESES:
                raise NeumatError("btf: synthesis", f"one of {', '.join(SYNTHESES)}", repr(name))
            btf = endless(representation, name, properties.get("seed", 0), flag(properties, PLUGIN, "tileable"))
            self.value = self.compiled if dr.is_jit_v(mi.Float) else self.interpreted
            if dr.is_jit_v(mi.Float):
                half = dr.backend_v(mi.Float) == dr.JitBackend.CUDA
                self.endless, self.decoder = endless_plane(btf.synthesis), Decoder(representation, half)
            else:
                self.endless = btf
            self.per_uv = 1 / positive(properties, "scale", 1.0)
            self.level = properties.get("level", None)
            self.texels = max(representation.size)
            super().__init__(properties, AnyTexel(representation))
            self.m_flags |= mi.BSDFFlags.Anisotropic | mi.BSDFFlags.SpatiallyVarying | mi.BSDFFlags.NonSymmetric
            self.m_components = [self.m_flags]
            if self.level is None:
                self.m_flags |= NEEDS_DIFFERENTIALS

        def reflected(self, ctx, si, wo, active):
            radiance = ctx.mode == mi.TransportMode.Radiance
            light, view = (wo, si.wi) if radiance else (si.wi, wo)
            # The frame's second axis is at right angles to the first; where uv is mirrored, v runs the other way.
            turned = dr.select(dr.dot(si.sh_frame.t, si.dp_dv) < 0, -1.0, 1.0)
            light, view = (mi.Vector3f(each.x, turned * each.y, each.z) for each in (light, view))
            value = called(self.value, active, si.uv, self.level_of(si), light, view) * self.scale
            return value if radiance else value * (wo.z / dr.maximum(si.wi.z, 1e-6))

        def level_of(self, si):
            """Return the level of detail of the footprint of a ray."""
            if self.level is not None:
                return mi.Float(self.level)
            width = dr.sqrt(dr.maximum(dr.squared_norm(si.duv_dx), dr.squared_norm(si.duv_dy)))
            return dr.log2(dr.maximum(width * (self.per_uv * self.texels), 1.0))

        def interpreted(self, uv, level, light, view):
            """Return the value of one query, by PyTorch."""
            u, light, view = (torch.tensor([list(each)], dtype=torch.float64) for each in (uv, light, view))
            return mi.Color3f(*self.endless.eval(u * self.per_uv, light.float(), view.float(), level)[0].tolist())

        def compiled(self, uv, level, light, view):
            features = self.endless.at(mi.Point2d(uv) * self.per_uv, None if self.level == 0 else level)
            return self.decoder.value(features, light, view)

        def traverse(self, callback):
            if dr.is_jit_v(mi.Float):
                callback.put("plane", self.endless.pyramid.values, mi.ParamFlags.Differentiable)

        def to_string(self):
            return "Btf[]"

    return {PLUGIN: Btf}


def positive(properties, key, default):
    """Return a property that is a number above 0. Raises NeumatError for another."""
    value = properties.get(key, default)
    if not (isinstance(value, (int, float)) and 0 < value < math.inf):
        raise NeumatError(f"btf: {key}", "a number above 0", repr(value))
    return value


serve((PLUGIN,), _classes)
