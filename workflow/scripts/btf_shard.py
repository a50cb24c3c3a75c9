"""Capture a shard of a surface's random queries or pictures."""

from neumat.btf.stages import capture_shard
from neumat.stage import progress, stage

with stage(snakemake):
    params, names = snakemake.params, snakemake.wildcards
    capture_shard(
        params.surface,
        names.capture,
        params.settings,
        int(names.shard),
        int(names.shards),
        params.seed,
        snakemake.output[0],
        progress,
        params.stores,
    )
