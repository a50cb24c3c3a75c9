"""Read a user's measured BTF."""

from neumat.btf.measured import read_measured
from neumat.stage import progress, stage

with stage(snakemake):
    read_measured(snakemake.input[0], snakemake.output[0], **snakemake.params.options, progress=progress)
