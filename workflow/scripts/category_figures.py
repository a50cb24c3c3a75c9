"""The statistics behind the categories: M3ashy's Figs. 23 to 25, and the boundaries of k-means."""

from neumat.brdf.types import read_types
from neumat.files import atomic_path
from neumat.reporting.category_figures import statistics_by_material, statistics_by_type
from neumat.reporting.kmeans_figure import kmeans_figure
from neumat.stage import config_file, stage
from neumat.studies.categories import with_types
from neumat.studies.clusters import kmeans_table
from neumat.tables import read_table

with stage(snakemake):
    statistics, output = read_table(snakemake.input.sources), snakemake.output
    table = with_types(statistics, read_types(config_file(snakemake, "types.tsv")))
    statistics_by_type(table, output.by_type)
    statistics_by_material(table, output.by_material)
    kmeans_figure(statistics, output.kmeans)
    with atomic_path(output.table) as temporary:
        kmeans_table(statistics).to_csv(temporary, index=False)
