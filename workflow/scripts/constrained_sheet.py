"""The materials found in one category, rendered by Mitsuba, under the line that says how the search ended."""

from neumat.render.mitsuba_scene import render_grid
from neumat.reporting.category_figures import constrained_sheet
from neumat.stage import stage
from neumat.studies.constrained import read_found

COLUMNS = 6

with stage(snakemake):
    weights, attributes = read_found(snakemake.input[0])
    columns = min(COLUMNS, len(weights))
    image = render_grid(weights, columns, snakemake.params.size, snakemake.params.samples) if columns else None
    constrained_sheet(image, attributes["message"], snakemake.output[0])
