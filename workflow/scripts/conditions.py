"""Types, captions and pictures of every material, encoded."""

from neumat.conditions.store import make_conditions, write_conditions
from neumat.stage import config_file, progress, stage

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    tables = (config_file(snakemake, f"{name}.tsv") for name in ("types", "prompts", "things"))
    conditions = make_conditions(store.neumerl, store.manifest, *tables, params.config, params.seed, progress)
    write_conditions(snakemake.output[0], conditions)
