"""The first materials found in each category, rendered by Mitsuba: M3ashy's Fig. 6."""

from neumat.reporting.conditional import category_figure
from neumat.stage import stage
from neumat.studies.constrained import read_found

with stage(snakemake):
    stores, params = snakemake.input, snakemake.params
    found = {attributes["category"]: weights for weights, attributes in map(read_found, stores)}
    category_figure(found, params.size, params.samples, snakemake.output[0])
