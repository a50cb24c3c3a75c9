"""The first samples of the diffusion model, rendered by Mitsuba."""

from neumat.fields.store import read_samples
from neumat.render.mitsuba_scene import render_grid
from neumat.reporting.sheets import save_image
from neumat.stage import stage

with stage(snakemake):
    render = snakemake.params.render
    weights = read_samples(snakemake.input[0])[0][: render["grid_rows"] * render["grid_columns"]]
    image = render_grid(weights, render["grid_columns"], render["grid_size"], render["grid_samples"])
    save_image(image, snakemake.output[0])
