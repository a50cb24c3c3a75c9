"""Gather the shards of a capture; of a measured surface, take the capture from its pictures."""

from neumat.btf.capture import gather
from neumat.btf.measured_captures import write_measured_capture
from neumat.btf.store import read_btf
from neumat.stage import progress, stage

with stage(snakemake):
    params, paths, out = snakemake.params, snakemake.input, snakemake.output[0]
    if params.settings is None:
        gather(paths, out)
    else:
        capture = snakemake.wildcards.capture
        store = read_btf(paths[0])
        write_measured_capture(store, capture, params.settings, params.surface, params.seed, out, progress)
