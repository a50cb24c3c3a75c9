"""Fit a representation to a captured BTF."""

from neumat.btf.stages import fit_representation
from neumat.stage import progress, stage

with stage(snakemake):
    params, output = snakemake.params, snakemake.output
    fit_representation(
        snakemake.input[0],
        snakemake.wildcards.representation,
        params.hyperparameters,
        params.seed,
        output.model,
        output.cost,
        progress,
    )
