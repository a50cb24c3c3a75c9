"""Measured and neural materials as BSDF plugins of Mitsuba 3: importing this module registers them.

`nbrdf`: any material that neumat reads.
    filename: a file or folder that `neumat.export.read_material` reads, a field or a table; or a store of neumat;
        searched for as Mitsuba does for textures: beside the scene's file and on its search path
    material: the name of the material in the store, or its number in a file weights.npy
    weights: instead of a file, a text of 675 numbers, or of the numbers of a field of another width
    sampler: how directions are drawn, one of `neumat.render.lobes.SAMPLERS`; default "fitted"
    lobes: instead of a sampler, a text of the shares of `neumat.render.lobes.fit_lobes`: directions are drawn as those
        of the material that they were fitted to, so that pictures of two materials trace the same paths
    conserve: true (or the text "true") scales a material that reflects more than it receives down to where it
        doesn't; default false
`merl`: a table of MERL's format, with the properties filename, sampler, lobes and conserve.
`lambert`, `glossy`, `sgd`: the analytic models of the same names in `neumat.brdf.analytic`, with the properties
    sampler, lobes and conserve, and `parameters`, a text of numbers: albedo; albedo, f0 (three each), alpha; those of
    SGD_PARAMETERS, three each.

    import neumat.render.mitsuba_bsdf
    mi.load_dict({"type": "nbrdf", "filename": "chrome.safetensors"})

They are registered for the variant that is set (the best one if none is) and for each that is set later; in others than
those of RGB, loading one raises NeumatError. `weights`, a parameter of `mi.traverse`, is differentiable in the AD
variants, and an update of it compiles nothing anew; one with NaN, or with another number of weights, raises NeumatError
and changes nothing. Directions are unit vectors. The normal side reflects only: use `twosided` for
the other. Blend materials with Mitsuba's own `blendbsdf`.
"""

import re
import sys

from neumat.render.variant import check_llvm, variant

if "drjit" not in sys.modules:
    variant()  # finds the LLVM library that Dr.Jit loads at import

import drjit as dr
import mitsuba as mi
import torch

from neumat.brdf.analytic import SGD, SGD_PARAMETERS, Glossy, Lambert
from neumat.brdf.table import Table
from neumat.errors import NeumatError
from neumat.fields.field import Field
from neumat.fields.layout import WIDTHS, size, widths_of
from neumat.fields.physics import largest_albedo
from neumat.render import drjit_analytic, drjit_brdf
from neumat.render.lobes import check_sampler, fit_lobes, read_lobes
from neumat.render.plugin_properties import flag, material_of, parameters, table_of, text

PLUGINS = ("nbrdf", "merl", "lambert", "glossy", "sgd")
LARGEST_WEIGHT = 1e9  # with larger ones the sums of the layers could be infinite, and infinity less infinity is NaN


def checked_field(weights, widths=WIDTHS):
    """Return the Field of weights (n,).

    Raises NeumatError for another number of weights than these widths have, and where one is NaN or beyond
    LARGEST_WEIGHT: every pixel could be NaN.
    """
    expected = f"{size(widths)} finite numbers, at most {LARGEST_WEIGHT:g}"
    if weights.shape != (size(widths),):
        raise NeumatError("nbrdf: weights", expected, f"{weights.numel()} numbers")
    if not (weights.abs() <= LARGEST_WEIGHT).all():
        raise NeumatError("nbrdf: weights", expected, "larger or NaN")
    return Field(weights, widths)


def load_dict(scene):
    """Return mi.load_dict(scene); a bad property or file of ours ends in one line, a NeumatError."""
    try:
        return mi.load_dict(scene)
    except RuntimeError as error:
        # Mitsuba gives the text of an exception raised by a plugin, its traceback included.
        found = re.search(r"NeumatError: (.*?): expected (.*); found (.*)", str(error))
        if found is None:
            raise
        raise NeumatError(*found.groups()) from error


def _classes():
    """Return the plugins {name: constructor} for the variant that is set."""

    lobe = mi.BSDFFlags.GlossyReflection

    class Material(mi.BSDF):
        """Reflection by an isotropic material; a subclass has `value(wi, wo)`, f as a Color3f."""

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
            value = drjit_brdf.called(self.value, active, si.wi, wo)
            return dr.select(active, value * (self.scale * wo.z), 0.0)

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

    class NeuralField(Material):
        """A field of 675 weights, or of another width."""

        def __init__(self, properties, weights):
            self.widths = widths_of(len(weights))
            Material.__init__(self, properties, checked_field(weights, self.widths))
            self.weights = drjit_brdf.buffer(weights)
            self.accepted = drjit_brdf.buffer(weights)

        def value(self, wi, wo):
            return drjit_brdf.field_value(self.weights, wi, wo, self.widths)

        def traverse(self, callback):
            callback.put("weights", self.weights, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys):
            found = dr.detach(self.weights).numpy()
            try:
                self.adapt(checked_field(torch.from_numpy(found), self.widths))
            except NeumatError:  # too few weights would be read past their end
                self.weights[:] = self.accepted
                raise
            self.accepted = drjit_brdf.buffer(found)

        def to_string(self):
            return "NeuralField[]"

    class Tabulated(Material):
        """A table on the MERL grid."""

        def __init__(self, properties, table):
            Material.__init__(self, properties, table)
            self.table = drjit_brdf.buffer(torch.cat([table.values, table.valid[:, None]], 1))

        def value(self, wi, wo):
            return drjit_brdf.table_value(self.table, wi, wo)

        def to_string(self):
            return "Tabulated[]"

    class Analytic(Material):
        """An analytic model; `value` of its parameters in a buffer is a function of `drjit_analytic`."""

        def __init__(self, properties, model, parameters, value):
            Material.__init__(self, properties, model)
            self.parameters, self.formula = drjit_brdf.buffer(parameters), value

        def value(self, wi, wo):
            return self.formula(self.parameters, wi, wo)

        def to_string(self):
            return "Analytic[]"

    def lambert(properties):
        numbers = parameters(properties, "lambert", 3, slice(0))
        return Analytic(properties, Lambert(numbers), numbers, drjit_analytic.lambert_value)

    def glossy(properties):
        numbers = parameters(properties, "glossy", 7, slice(6, 7))
        model = Glossy(numbers[:3], numbers[3:6], numbers[6])
        return Analytic(properties, model, numbers, drjit_analytic.glossy_value)

    def sgd(properties):
        numbers = parameters(properties, "sgd", 3 * len(SGD_PARAMETERS), slice(6, 9))
        model = SGD(dict(zip(SGD_PARAMETERS, numbers.view(-1, 3), strict=True)))
        return Analytic(properties, model, numbers, drjit_analytic.sgd_value)

    def nbrdf(properties):
        material = material_of(properties)
        return (Tabulated if isinstance(material, Table) else NeuralField)(properties, material)

    def merl(properties):
        return Tabulated(properties, table_of(properties))

    return dict(zip(PLUGINS, (nbrdf, merl, lambert, glossy, sgd), strict=True))


def _not_served(properties):
    raise NeumatError(
        properties.plugin_name(), "an RGB variant of Mitsuba (cuda_ad_rgb, llvm_ad_rgb, scalar_rgb)", mi.variant()
    )


def register(*_):
    """Register the plugins for the variant of Mitsuba that is set; in others than RGB's, loading one says so.

    Raises NeumatError where the variant needs LLVM and has none that works.
    """
    check_llvm(mi.variant())
    plugins = _classes() if mi.variant().endswith("_rgb") else dict.fromkeys(PLUGINS, _not_served)
    for name, plugin in plugins.items():
        mi.register_bsdf(name, plugin)


if mi.variant() is None:
    mi.set_variant(variant())
register()
mi.detail.add_variant_callback(register)
