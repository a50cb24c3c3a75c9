"""Train one generative model under one protocol; an interrupted training resumes from its checkpoint."""

from neumat.generative.dataset import training_dataset
from neumat.generative.registry import METHODS
from neumat.stage import progress, stage

with stage(snakemake):
    store, params, names = snakemake.input, snakemake.params, snakemake.wildcards
    kind = METHODS[names.method]
    model = kind.from_config(dict(params.hyperparameters))
    dataset = training_dataset(
        store.neumerl, store.manifest, store.sources, names.protocol, params.components, kind, store.get("dense")
    )
    model.fit(dataset, params.seed, progress, params.checkpoint).save(snakemake.output[0])
