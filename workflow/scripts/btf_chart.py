"""Chart 6: the error of fits of a surface against their bytes, and against the time of a query."""

from pathlib import Path

from neumat.files import atomic_path
from neumat.reporting.btf_chart import chart_table, representations_chart
from neumat.stage import stage

with stage(snakemake):
    output, table = snakemake.output, chart_table(snakemake.input)
    for cost, path in (("bytes", output.by_bytes), ("ns", output.by_ns)):
        representations_chart(table, cost, Path(path).with_suffix(""))
    with atomic_path(output.table) as temporary:
        table.to_csv(temporary, index=False)
