"""Gather the shards of a capture."""

from neumat.btf.capture import gather
from neumat.stage import stage

with stage(snakemake):
    gather(snakemake.input, snakemake.output[0])
