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

from neumat.render.variant import variant

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
from neumat.render import drjit_analytic, drjit_brdf
from neumat.render.mitsuba_material import material_class, serve
from neumat.render.plugin_properties import material_of, parameters, table_of

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

    Material = material_class()

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


serve(PLUGINS, _classes)
