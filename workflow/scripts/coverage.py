"""Coverage, precision, novelty and validity of the default model and of nulls under one fold."""

from neumat.files import atomic_path
from neumat.generative.hyperdiffusion import HyperDiffusion
from neumat.stage import progress, stage
from neumat.studies.coverage import Sides, denoising_error, measure

with stage(snakemake):
    store, params, output = snakemake.input, snakemake.params, snakemake.output
    paths = store.neumerl, store.manifest, store.sources
    sides = Sides(snakemake.wildcards.protocol, paths, params.entries, params.dense, params.seed)
    model = HyperDiffusion.load(store.model)
    model.sampler, model.nfe = params.sampling["sampler"], params.sampling["nfe"]
    tables = measure(sides, model, params.sizes, params.sampling["seed"], progress), denoising_error(sides, model)
    for table, path in zip(tables, (output.coverage, output.memorisation), strict=True):
        with atomic_path(path) as temporary:
            table.to_csv(temporary, index=False)
