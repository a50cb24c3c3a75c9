"""What a run cost: wall time, CPU time and peak memory, from Snakemake's benchmark files."""

from pathlib import Path

import pandas as pd

from neumat.errors import NeumatError

_COLUMNS = {"s": "wall_s", "cpu_time": "cpu_s", "max_rss": "peak_mib"}


def run_table(folder):
    """Return stage, job, wall_s, cpu_s, peak_mib of every benchmark file (*.tsv) under `folder`, then totals.

    The stage is the first part of a file's path, the job the rest. After the jobs comes one row per stage with several
    jobs and one for the run, with job "total": summed times and the highest peak of any one job. What Snakemake could
    not measure (a job of a moment) is empty. Repeats of a benchmark are averaged.
    Raises NeumatError where there is no benchmark file, or one is not Snakemake's.
    """
    folder = Path(folder)
    paths = sorted(folder.rglob("*.tsv"))
    if not paths:
        raise NeumatError(folder, "Snakemake benchmark files (*.tsv)", "none")
    jobs = pd.DataFrame([_job(path, folder) for path in paths])
    totals = []
    for stage, group in [*jobs.groupby("stage", sort=False), ("run", jobs)]:
        if len(group) > 1 or stage == "run":
            sums = group[["wall_s", "cpu_s"]].sum()
            totals.append({"stage": stage, "job": "total", **sums, "peak_mib": group["peak_mib"].max()})
    return pd.concat([jobs, pd.DataFrame(totals)], ignore_index=True).round(2)


def _job(path, folder):
    table = pd.read_csv(path, sep="\t", na_values=["-"])
    if not set(_COLUMNS) <= set(table):
        raise NeumatError(path, f"Snakemake's columns {', '.join(_COLUMNS)}", ", ".join(map(str, table.columns)))
    stage, *rest = path.relative_to(folder).with_suffix("").parts
    return {"stage": stage, "job": "/".join(rest) or stage, **table[list(_COLUMNS)].mean().rename(_COLUMNS)}
