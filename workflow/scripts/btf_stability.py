"""Drive captures, representations and synthesis of BTFs to where they break, and write down what happens there."""

from pathlib import Path
from tempfile import TemporaryDirectory

from neumat.files import atomic_path
from neumat.stability.btf import stability_table
from neumat.stability.btf_bench import BtfBench
from neumat.stage import progress, stage

with stage(snakemake):
    params = snakemake.params
    with TemporaryDirectory() as folder:
        bench = BtfBench(params.surface, **params.settings, seed=params.seed, folder=Path(folder))
        table = stability_table(bench, progress)
    with atomic_path(snakemake.output[0]) as temporary:
        table.to_csv(temporary, index=False)
