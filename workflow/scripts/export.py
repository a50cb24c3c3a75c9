"""Write one material in one format."""

import logging

from neumat.export import export, find_material
from neumat.stage import stage

with stage(snakemake):
    store, names = snakemake.input[0], snakemake.wildcards
    weights = find_material(store, names.material)
    logging.info("wrote %s", export(weights, names.format, snakemake.output[0], names.material, store))
