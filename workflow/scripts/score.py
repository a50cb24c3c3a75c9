"""Score one method's samples, or draws of the training set, against the held-out and the training materials."""

from neumat.files import atomic_path
from neumat.stage import stage
from neumat.studies.protocols import Protocol, score_method

with stage(snakemake):
    store, params, names = snakemake.input, snakemake.params, snakemake.wildcards
    protocol = Protocol(
        names.protocol, store.neumerl, store.manifest, store.sources, params.entries, params.size, params.seed
    )
    tables = score_method(
        protocol, names.method, store.get("samples"), params.draws, params.set_size, store.get("inception")
    )
    for table, path in zip(tables, (snakemake.output.scores, snakemake.output.novelty), strict=True):
        with atomic_path(path) as temporary:
            table.to_csv(temporary, index=False)
