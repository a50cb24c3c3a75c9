"""Gather the folds' rows of coverage and of the denoiser's errors into tables, and draw the chart."""

from pathlib import Path

import pandas as pd

from neumat.files import atomic_path
from neumat.reporting.coverage import coverage_chart, coverage_table
from neumat.stage import stage
from neumat.tables import read_table

with stage(snakemake):
    files, params, output = snakemake.input, snakemake.params, snakemake.output
    rows, errors = (pd.concat(map(read_table, paths)) for paths in (files.coverage, files.memorisation))
    table = coverage_table(rows, params.bootstrap, params.seed)
    errors = errors.groupby(["sigma", "side"], sort=False)[["error", "materials"]].mean().reset_index()
    for found, path in ((table, output.table), (errors, output.memorisation)):
        with atomic_path(path) as temporary:
            found.to_csv(temporary, index=False)
    coverage_chart(table, Path(output.chart).with_suffix(""))
