"""The paper's Table 2 over the scores of all methods and protocols."""

from neumat.files import atomic_path
from neumat.reporting.tables import table2, table2_markdown
from neumat.stage import stage

with stage(snakemake):
    table = table2(snakemake.input, snakemake.params.seed, snakemake.params.bootstrap)
    with atomic_path(snakemake.output.table) as temporary:
        table.to_csv(temporary, index=False)
    with atomic_path(snakemake.output.readable) as temporary:
        temporary.write_text(table2_markdown(table), encoding="utf-8")
