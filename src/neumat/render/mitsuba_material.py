"""What all BSDF plugins share: reflection on the normal side, directions drawn by lobes, registration."""

import sys

from neumat.render.variant import check_llvm, variant

if "drjit" not in sys.modules:
    variant()  # finds the LLVM library that Dr.Jit loads at import

import drjit as dr
import mitsuba as mi

from neumat.errors import NeumatError
from neumat.fields.physics import largest_albedo
from neumat.render import drjit_brdf
from neumat.render.lobes import check_sampler, fit_lobes, read_lobes
from neumat.render.plugin_properties import flag, text


def material_class():
    """Return the class of materials for the variant of Mitsuba that is set."""

    lobe = mi.BSDFFlags.GlossyReflection

    class Material(mi.BSDF):
        """Reflection by an isotropic material; a subclass has `value(wi, wo)`, f as a Color3f, or `reflected`."""

        def __init__(self, properties, material):
            mi.BSDF.__init__(self, properties)
            self.m_components = [lobe | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]
            self.sampler = properties.get("sampler", "fitted")
            check_sampler(self.sampler)
            name = properties.plugin_name()
            self.given = read_lobes(text(properties, name, "lobes")) if "lobes" in properties else None
            if self.given is not None and "sampler" in properties:
                raise NeumatError("lobes", "no property sampler beside them", repr(self.sampler))
            self.conserve = flag(properties, name, "conserve")
            self.adapt(material)

        def adapt(self, material):
            """Fit what depends on the material beside its values."""
            lobes = fit_lobes(material, self.sampler) if self.given is None else self.given
            self.lobes = drjit_brdf.buffer(lobes)
            scale = 1 / max(1.0, largest_albedo(material)) if self.conserve else 1.0
            self.scale = dr.opaque(mi.Float, scale) if dr.is_jit_v(mi.Float) else scale

        # Scalar variants run both branches of a select, and numbers raise where arrays have NaN: what is not active
        # ends early there.

        def sample(self, ctx, si, sample1, sample2, active=True):
            active = active & ctx.is_enabled(lobe) & (si.wi.z > 0)
            if active is False:
                return mi.BSDFSample3f(), mi.Color3f(0.0)
            if self.sampler == "uniform":
                wo = mi.warp.square_to_uniform_hemisphere(sample2)
            else:
                wo = drjit_brdf.lobes_sample(self.lobes, si.wi, sample2)
            value, density = self.eval_pdf(ctx, si, wo, active)
            active = active & (density > 0)
            bs = mi.BSDFSample3f()
            bs.wo, bs.eta, bs.sampled_component, bs.pdf = wo, 1.0, 0, density
            bs.sampled_type = mi.UInt32(+lobe)
            return bs, dr.select(active, value / dr.select(active, density, 1.0), 0.0)

        def eval(self, ctx, si, wo, active=True):
            active = active & ctx.is_enabled(lobe) & (si.wi.z > 0) & (wo.z > 0)
            if active is False:
                return mi.Color3f(0.0)
            return dr.select(active, self.reflected(ctx, si, wo, active), 0.0)

        def reflected(self, ctx, si, wo, active):
            """Return f times the cosine of wo, a Color3f."""
            return drjit_brdf.called(self.value, active, si.wi, wo) * (self.scale * wo.z)

        def pdf(self, ctx, si, wo, active=True):
            active = active & ctx.is_enabled(lobe) & (si.wi.z > 0) & (wo.z > 0)
            if active is False:
                return 0.0
            if self.sampler == "uniform":
                density = mi.warp.square_to_uniform_hemisphere_pdf(wo)
            else:
                density = drjit_brdf.lobes_density(self.lobes, si.wi, wo)
            return dr.select(active, density, 0.0)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    return Material


def _not_served(properties):
    raise NeumatError(
        properties.plugin_name(), "an RGB variant of Mitsuba (cuda_ad_rgb, llvm_ad_rgb, scalar_rgb)", mi.variant()
    )


def serve(names, classes):
    """Register the plugins `names` for the variant of Mitsuba that is set, the best one if none is, and later ones.

    classes: returns {name: constructor} for the variant that is set. In others than RGB's, loading one says so.
    Raises NeumatError where the variant needs LLVM and has none that works.
    """

    def register(*_):
        check_llvm(mi.variant())
        plugins = classes() if mi.variant().endswith("_rgb") else dict.fromkeys(names, _not_served)
        for name, plugin in plugins.items():
            mi.register_bsdf(name, plugin)

    if mi.variant() is None:
        mi.set_variant(variant())
    register()
    mi.detail.add_variant_callback(register)
