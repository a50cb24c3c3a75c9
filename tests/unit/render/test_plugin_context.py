"""Our BSDFs obey Mitsuba's context as Mitsuba's own do: `roughconductor`, which has one glossy lobe too, is the
witness."""

import itertools

import numpy as np
import pytest

from neumat.render.mitsuba_scene import mitsuba

OURS = {"type": "glossy", "parameters": "0.2 0.1 0.1 0.04 0.04 0.04 0.3"}
WITNESS = {"type": "roughconductor", "alpha": 0.3}
DIFFUSE = {"type": "diffuse"}
PLACES = {
    "alone": lambda bsdf: bsdf,
    "twosided": lambda bsdf: {"type": "twosided", "a": bsdf},
    "front of two": lambda bsdf: {"type": "twosided", "a": bsdf, "b": DIFFUSE},
    "first of a blend": lambda bsdf: {"type": "blendbsdf", "weight": 0.3, "a": bsdf, "b": DIFFUSE},
    "second of a blend": lambda bsdf: {"type": "blendbsdf", "weight": 0.3, "a": DIFFUSE, "b": bsdf},
    "twosided blend": lambda bsdf: {"type": "twosided", "a": PLACES["second of a blend"](bsdf)},
    "mask": lambda bsdf: {"type": "mask", "opacity": 0.5, "a": bsdf},
}
EVERYTHING = 0xFFFFFFFF
SIDES = (
    ((0.3, 0.2, 0.9), (-0.3, -0.1, 0.9)),
    ((0.3, 0.2, -0.9), (-0.3, -0.1, -0.9)),
    ((0.3, 0.2, 0.9), (0, 0.1, -0.9)),
)


@pytest.fixture
def mi():
    """Mitsuba in its scalar variant, where nothing is compiled; the best one again afterwards."""
    module = mitsuba()
    best = module.variant()
    module.set_variant("scalar_rgb")
    yield module
    module.set_variant(best)


def answers(mi, bsdf, context, wi, wo):
    """Return what of eval, pdf, eval_pdf and sample is not 0, and the component and type of what is sampled."""
    si = mi.SurfaceInteraction3f()
    si.wi, wo = (mi.Vector3f(np.array(v) / np.linalg.norm(v)) for v in (wi, wo))
    value, density = bsdf.eval_pdf(context, si, wo)
    found = [max(bsdf.eval(context, si, wo)) > 0, bsdf.pdf(context, si, wo) > 0, max(value) > 0, density > 0]
    for choice in (0.1, 0.9):
        sample, weight = bsdf.sample(context, si, choice, mi.Point2f(0.4, 0.3))
        drawn = sample.pdf > 0
        found += [drawn, max(weight) > 0, drawn and (sample.sampled_component, sample.sampled_type)]
    return found


@pytest.mark.parametrize("place", PLACES)
def test_masks_and_components_are_obeyed_as_by_mitsubas_own(mi, place):
    ours, witness = (mi.load_dict(PLACES[place](bsdf)) for bsdf in (OURS, WITNESS))
    assert (ours.component_count(), ours.flags()) == (witness.component_count(), witness.flags())
    flags = mi.BSDFFlags
    masks = (flags.GlossyReflection, flags.DiffuseReflection, flags.Glossy, flags.Reflection, flags.Delta, flags.All)
    seen = set()
    for mask, component in itertools.product((EVERYTHING, 0, *map(int, masks)), (EVERYTHING, 0, 1, 2)):
        context = mi.BSDFContext()
        context.type_mask, context.component = mask, component
        for wi, wo in SIDES:
            found = answers(mi, ours, context, wi, wo)
            assert found == answers(mi, witness, context, wi, wo), (hex(mask), component, wi)
            seen.add(found[0])
    assert seen == {True, False}


@pytest.mark.usefixtures("compiled")
def test_masks_are_obeyed_in_compiled_variants_too():
    import drjit as dr

    mi = mitsuba()
    bsdf, si = mi.load_dict(OURS), dr.zeros(mi.SurfaceInteraction3f, 2)
    si.wi, wo = mi.Vector3f(0, 0.6, 0.8), mi.Vector3f(0, -0.6, 0.8)
    for kind, reflects in ((mi.BSDFFlags.GlossyReflection, True), (mi.BSDFFlags.DiffuseReflection, False)):
        context = mi.BSDFContext()
        context.type_mask = int(kind)
        value, density = bsdf.eval_pdf(context, si, wo)
        _, weight = bsdf.sample(context, si, mi.Float(0.5), mi.Point2f(0.4, 0.3))
        for numbers in (value, density, weight):
            assert ((np.array(numbers) > 0) == reflects).all()
