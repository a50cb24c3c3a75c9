"""Draw the dense bases."""

from neumat.fields.dense_stages import write_recipe
from neumat.stage import stage

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    write_recipe(store.manifest, store.neumerl, params.dense, params.seed, snakemake.output[0])
