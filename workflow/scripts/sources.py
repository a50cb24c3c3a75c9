"""Read the measured materials into one store."""

from neumat.brdf.sources import write_sources
from neumat.stage import progress, stage

with stage(snakemake):
    sources = dict(snakemake.params.sources)
    write_sources(sources, snakemake.output[0], limit=sources.pop("count"), progress=progress)
