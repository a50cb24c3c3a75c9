"""Fit one shard of the dense bases."""

from neumat.fields.dense_stages import fit_dense_shard
from neumat.stage import progress, stage

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    files = store.recipe, store.sources, store.neumerl
    fit_dense_shard(*files, params.indices, params.fit, params.seed, snakemake.output[0], progress)
