"""Tune the unconditional model to requests; an interrupted run resumes from its checkpoint."""

from neumat.conditions.things import packed, read_things
from neumat.conditions.training import tune
from neumat.stage import config_file, progress, stage

with stage(snakemake):
    params = snakemake.params
    served = dict(params.served) | {"things": packed(read_things(config_file(snakemake, "things.tsv")))}
    model = tune(
        dict(snakemake.input), params.protocol, dict(params.tuning), params.rules, params.sampling, served,
        params.seed, progress, params.checkpoint,
    )  # fmt: skip
    model.save(snakemake.output[0])
