"""Gather the rows of novelty into one table."""

from neumat.files import atomic_path
from neumat.reporting.tables import novelty_table
from neumat.stage import stage

with stage(snakemake), atomic_path(snakemake.output[0]) as temporary:
    novelty_table(snakemake.input).to_csv(temporary, index=False)
