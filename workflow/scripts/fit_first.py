"""Fit the first material's field, from which all others start."""

from neumat.fields.stages import fit_first
from neumat.stage import progress, stage

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    fit_first(store.augmerl, store.sources, params.fit, params.seed, snakemake.output[0], progress)
