"""Gather the shards into the store of the dense set."""

from neumat.fields.dense_stages import gather_dense
from neumat.stage import stage

with stage(snakemake):
    gather_dense(snakemake.input.shards, snakemake.input.recipe, snakemake.output[0])
