"""Wall time, CPU time and peak memory of every stage, from Snakemake's benchmark files and the logs."""

from pathlib import Path

from neumat.files import atomic_path
from neumat.reporting.run_table import run_table
from neumat.stage import stage

with stage(snakemake):
    folder = Path("results/benchmarks")
    for path in folder.glob("fit_shard/*.tsv"):
        if not path.stem.endswith(f"-of-{snakemake.params.shards}"):
            path.unlink()  # of an earlier run with shards of another size
    with atomic_path(snakemake.output[0]) as temporary:
        run_table(folder, "results/logs").to_csv(temporary, index=False)
