"""Time queries of a BTF, with and without synthesis, against plain PyTorch."""

from neumat.btf.representations.registry import load_representation
from neumat.files import atomic_path
from neumat.stage import progress, stage
from neumat.studies.btf_queries import query_bench

with stage(snakemake):
    params = snakemake.params
    model = load_representation(snakemake.input[0])
    rows = query_bench(model, params.methods, params.counts, params.seed, progress)
    with atomic_path(snakemake.output[0]) as temporary:
        rows.to_csv(temporary, index=False)
