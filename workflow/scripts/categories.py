"""The categories of the sources, what other readings of the rules change, overlaps, agreement with the names."""

from neumat.brdf.types import read_types
from neumat.files import atomic_path
from neumat.stage import config_file, stage
from neumat.studies.categories import names_table, overlap_table, readings_table, source_table
from neumat.tables import read_table

with stage(snakemake):
    rules = snakemake.params.rules
    fields, sources = (read_table(path) for path in (snakemake.input.fields, snakemake.input.sources))
    table = source_table(sources, read_types(config_file(snakemake, "types.tsv")), rules)
    tables = {
        "categories": table,
        "readings": readings_table(sources, fields, rules),
        "overlap": overlap_table(sources, fields, rules),
        "names": names_table(table),
    }
    for name, rows in tables.items():
        with atomic_path(snakemake.output[name]) as temporary:
            rows.to_csv(temporary, index=False)
