"""What fits of dense bases cost and reach."""

from neumat.files import atomic_path
from neumat.stage import progress, stage
from neumat.studies.dense_fits import dense_fits

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    files = store.recipe, store.dense, store.sources, store.neumerl, store.first
    table = dense_fits(*files, params.fit, params.materials, params.seed, progress)
    with atomic_path(snakemake.output[0]) as path:
        table.to_csv(path, index=False)
