"""What a run cost: wall time, CPU time and peak memory, from Snakemake's benchmark files and the jobs' logs."""

import datetime
import os
import platform
import re
from pathlib import Path

import numpy as np
import pandas as pd

from neumat.errors import NeumatError

_COLUMNS = {"s": "wall_s", "cpu_time": "cpu_s", "max_rss": "peak_mib"}


def run_table(folder, logs):
    """Return stage, job, wall_s, cpu_s, peak_mib of every benchmark file (*.tsv) under `folder`, then totals.

    The stage is the first part of a file's path, the job the rest. Snakemake looks at a job every 30 seconds once it
    has run for 15; CPU time is that which the job's log, of the same path under `logs`, ends with, where there is one.
    After the jobs comes one row per stage with several jobs and one for the run, with job "total": summed times and
    the highest peak of any one job; last, with job "elapsed", the wall time in which at least one job ran (a file's
    time of writing is its job's end); this row alone has `ended`, the day of the last job's end, and `machine`, the
    one that this is called on. What Snakemake could not measure (a job of a moment) is empty. Repeats of a benchmark
    are averaged.
    Raises NeumatError where there is no benchmark file, or one is not Snakemake's.
    """
    folder = Path(folder)
    paths = sorted(folder.rglob("*.tsv"))
    if not paths:
        raise NeumatError(folder, "Snakemake benchmark files (*.tsv)", "none")
    jobs = pd.DataFrame([_job(path, folder, logs) for path in paths])
    totals = []
    for stage, group in [*jobs.groupby("stage", sort=False), ("run", jobs)]:
        if len(group) > 1 or stage == "run":
            sums = group[["wall_s", "cpu_s"]].sum()
            totals.append({"stage": stage, "job": "total", **sums, "peak_mib": group["peak_mib"].max()})
    ends = np.array([path.stat().st_mtime for path in paths])
    elapsed = covered(ends - jobs["wall_s"].to_numpy(), ends)
    ended = datetime.date.fromtimestamp(ends.max())
    totals.append({"stage": "run", "job": "elapsed", "wall_s": elapsed, "ended": ended, "machine": machine()})
    return pd.concat([jobs, pd.DataFrame(totals)], ignore_index=True).round(2)


def machine():
    """Return the machine in words: cores, architecture, the processor's name where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor() or platform.machine()
    return f"{os.cpu_count()} cores of {name}, {platform.machine()}"


def covered(starts, ends):
    """Return the length of the union of intervals (n,) each."""
    order = np.argsort(starts)
    starts, ends = starts[order], ends[order]
    before = np.concatenate([[-np.inf], np.maximum.accumulate(ends)[:-1]])
    return np.clip(ends - np.maximum(starts, before), 0, None).sum()


def _job(path, folder, logs):
    table = pd.read_csv(path, sep="\t", na_values=["-"])
    if not set(_COLUMNS) <= set(table):
        raise NeumatError(path, f"Snakemake's columns {', '.join(_COLUMNS)}", ", ".join(map(str, table.columns)))
    name = path.relative_to(folder)
    stage, *rest = name.with_suffix("").parts
    measured = table[list(_COLUMNS)].mean().rename(_COLUMNS)
    log = Path(logs) / name.with_suffix(".log")
    used = re.search(r"([0-9.]+) s of CPU time\s*$", log.read_text()) if log.exists() else None
    if used:
        measured["cpu_s"] = float(used[1])
    return {"stage": stage, "job": "/".join(rest) or stage, **measured}
