"""What a material of each category costs, and how well those found match the category."""

from neumat.files import atomic_path
from neumat.metrics.novelty import NOVELTY_ENTRIES
from neumat.reporting.category_figures import constrained_chart
from neumat.stage import stage
from neumat.studies.constrained import constrained_table
from neumat.studies.protocols import Protocol
from neumat.tables import read_table

PICTURES = 16  # pixels; none is drawn

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    protocol = Protocol("parity", store.neumerl, store.manifest, store.sources, params.entries, PICTURES, params.seed)
    step = max(1, params.entries // NOVELTY_ENTRIES)
    table = constrained_table(store.found, protocol, read_table(store.statistics), params.rules, step)
    constrained_chart(table, snakemake.output.chart)
    with atomic_path(snakemake.output.table) as temporary:
        table.to_csv(temporary, index=False)
