"""Capture a patch of a surface that is larger than the exemplar."""

from neumat.btf.stages import capture_truth
from neumat.stage import progress, stage

with stage(snakemake):
    params, extent = snakemake.params, int(snakemake.wildcards.extent)
    out = snakemake.output[0]
    capture_truth(params.surface, params.settings, extent, params.seed, out, progress, params.stores)
