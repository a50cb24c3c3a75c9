"""Types, captions and pictures of every material, encoded."""

from neumat.conditions.store import make_conditions, write_conditions
from neumat.stage import progress, stage

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    conditions = make_conditions(
        store.neumerl, store.manifest, store.types, store.prompts, params.config, params.seed, progress
    )
    write_conditions(snakemake.output[0], conditions)
