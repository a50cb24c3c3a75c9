"""Put together how near fits come to surfaces of more and of less relief."""

from neumat.files import atomic_path
from neumat.reporting.btf_chart import relief_table
from neumat.stage import stage

with stage(snakemake), atomic_path(snakemake.output[0]) as temporary:
    relief_table(snakemake.input).to_csv(temporary, index=False)
