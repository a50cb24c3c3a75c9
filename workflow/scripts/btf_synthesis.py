"""Compare what every method synthesises from an exemplar with a larger patch of the surface, where there is one."""

from neumat.files import atomic_path
from neumat.stage import progress, stage
from neumat.studies.btf_synthesis import synthesis_table

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    paths, truth = dict(zip(params.names, store.models, strict=True)), store.truth or None
    methods = params.methods, params.default
    rows = synthesis_table(paths, store.queries, truth, *methods, params.seed, progress)
    rows.insert(0, "surface", snakemake.wildcards.surface)
    with atomic_path(snakemake.output[0]) as temporary:
        rows.to_csv(temporary, index=False)
