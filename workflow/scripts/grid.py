"""The first samples of the diffusion model, rendered by Mitsuba."""

import h5py
import torch

from neumat.render.mitsuba_scene import render_grid
from neumat.reporting.figures import save_image
from neumat.stage import stage

with stage(snakemake):
    render = snakemake.params.render
    with h5py.File(snakemake.input[0]) as file:
        weights = torch.from_numpy(file["samples"][: render["grid_rows"] * render["grid_columns"]])
    image = render_grid(weights, render["grid_columns"], render["grid_size"], render["grid_samples"])
    save_image(image, snakemake.output[0])
