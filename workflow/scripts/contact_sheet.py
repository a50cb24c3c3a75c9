"""Every fitted material, then every sampled one, as small spheres."""

import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.fields.store import read_neumerl, read_samples
from neumat.render.sphere import FrozenSphere, render_fields
from neumat.reporting.sheets import contact_sheet, save_image
from neumat.stage import stage

with stage(snakemake):
    params = snakemake.params
    fitted = read_neumerl(snakemake.input.neumerl).weights[:: len(PERMUTATIONS)]
    samples, _ = read_samples(snakemake.input.samples)
    pictures = render_fields(FrozenSphere(params.size), torch.cat([fitted, samples]))
    save_image(contact_sheet(pictures, params.columns, gap=0), snakemake.output[0])
