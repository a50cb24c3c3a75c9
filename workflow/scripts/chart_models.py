"""Chart 5, and the scenes' tables in one."""

from pathlib import Path

import pandas as pd

from neumat.files import atomic_path
from neumat.reporting.models_chart import costs, models_chart
from neumat.stage import stage
from neumat.tables import read_table

with stage(snakemake):
    output, tolerance = snakemake.output, snakemake.params.tolerance
    models, fits = (pd.concat(map(read_table, paths)) for paths in (snakemake.input.models, snakemake.input.fits))
    tables = {
        output.table: costs(models),
        output.chosen: models[models["tolerance"] == tolerance],
        output.fits: fits,
    }
    for path, table in tables.items():
        with atomic_path(path) as temporary:
            table.to_csv(temporary, index=False)
    models_chart(tables[output.table], tolerance, Path(output.table).with_suffix(""))
