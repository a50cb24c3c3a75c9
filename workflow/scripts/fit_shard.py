"""Fit one shard of the materials."""

from neumat.fields.stages import fit_shard
from neumat.stage import progress, stage

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    fit_shard(
        store.augmerl,
        store.sources,
        store.first,
        params.indices,
        params.fit,
        params.seed,
        snakemake.output[0],
        progress,
    )
