"""Gather the shards into NeuMERL."""

from neumat.fields.stages import fit_gather
from neumat.stage import stage

with stage(snakemake):
    fit_gather(snakemake.input.shards, snakemake.input.manifest, snakemake.output[0])
