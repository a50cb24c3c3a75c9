"""Tune the unconditional model to requests; an interrupted run resumes from its checkpoint."""

from neumat.conditions.training import tune
from neumat.stage import progress, stage

with stage(snakemake):
    params = snakemake.params
    model = tune(
        dict(snakemake.input), dict(params.tuning), params.rules, params.sampling, dict(params.served),
        params.seed, progress, params.checkpoint,
    )  # fmt: skip
    model.save(snakemake.output[0])
