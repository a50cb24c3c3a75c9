"""Blend and permute the sources: AugMERL."""

from neumat.augment.build import build
from neumat.stage import stage

with stage(snakemake):
    build(
        snakemake.input[0],
        snakemake.params.augment,
        snakemake.params.seed,
        snakemake.output.store,
        snakemake.output.manifest,
        snakemake.output.table,
    )
