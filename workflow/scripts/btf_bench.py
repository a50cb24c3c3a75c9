"""Time the fit of a BTF against plain PyTorch."""

from neumat.btf.store import read_btf
from neumat.files import atomic_path
from neumat.stage import stage
from neumat.studies.btf_fit_bench import fit_bench

with stage(snakemake):
    params = snakemake.params
    queries, held_out = (read_btf(path) for path in snakemake.input)
    rows = fit_bench(queries, held_out, params.hyperparameters, params.seed)
    with atomic_path(snakemake.output[0]) as temporary:
        rows.to_csv(temporary, index=False)
