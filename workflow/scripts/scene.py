"""One scene, rendered by Mitsuba."""

from neumat.render.mitsuba_scene import bsdf
from neumat.reporting.sheets import save_image
from neumat.scenes.compose import compose
from neumat.scenes.materials import Materials
from neumat.scenes.model_selection import layout_materials
from neumat.scenes.pictures import render, shown, without_fireflies
from neumat.stage import progress, stage

with stage(snakemake):
    layout, picture, store = snakemake.params.layout, snakemake.params.picture, snakemake.input
    found = layout_materials(layout, Materials(store.neumerl, store.manifest, store.samples))
    plugins = {unit: bsdf(weights) for unit, (_, weights) in found.items()}
    composition = compose(layout, plugins, picture["width"], picture["height"])
    linear = render(composition, picture["samples"], progress=progress)
    save_image(shown(without_fireflies(linear), layout["exposure"]), snakemake.output[0])
