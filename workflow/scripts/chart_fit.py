"""Chart 1: what a fit costs against what it reaches."""

from pathlib import Path

from neumat.files import atomic_path
from neumat.reporting.charts import frontier_chart
from neumat.stage import progress, stage
from neumat.studies.fit_sweep import sweep
from neumat.studies.measured_fits import SETS

PANELS = [("loss", "loss_grid", "min", "held-out log-cosine loss"), ("psnr", "psnr", "max", "rendered PSNR, dB")]

with stage(snakemake):
    store, params, output = snakemake.input, snakemake.params, snakemake.output
    given = store.augmerl, store.sources, params.fit, params.published, params.materials, store.measured
    table = sweep(*given, params.size, params.seed, progress)
    for name, y, goal, title in PANELS:
        frontier_chart(
            table,
            "seconds",
            y,
            "label",
            table["label"][0],
            Path(output[name]).with_suffix(""),
            goal,
            group="family",
            apart=SETS,
            x_title="CPU seconds per material, its share of the first field included",
            y_title=title,
        )
    with atomic_path(output.table) as path:
        table.to_csv(path, index=False)
