"""Render every base material from its table and from its field, and compare."""

import pandas as pd

from neumat.files import atomic_path
from neumat.stage import progress, stage
from neumat.studies.fit_quality import fit_quality, fit_summary
from neumat.tables import read_table

with stage(snakemake):
    store = snakemake.input
    table = fit_quality(store.neumerl, store.augmerl, store.sources, snakemake.params.size, progress)
    table = pd.concat([table, read_table(store.measured)])
    with atomic_path(snakemake.output.table) as path:
        table.to_csv(path, index=False)
    with atomic_path(snakemake.output.summary) as path:
        fit_summary(table).to_csv(path, index=False)
