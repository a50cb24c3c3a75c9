"""Score every method's samples, and draws of the training set, against the held-out materials."""

from neumat.files import atomic_path
from neumat.stage import progress, stage
from neumat.studies.protocols import Protocol, score_protocol

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    protocol = Protocol(
        snakemake.wildcards.protocol, store.neumerl, store.manifest, store.sources, params.entries, params.size,
        params.seed,
    )  # fmt: skip
    samples = dict(zip(params.methods, store.samples, strict=True))
    scores = score_protocol(protocol, samples, params.draws, params.set_size, store.get("inception"), progress)
    with atomic_path(snakemake.output[0]) as temporary:
        scores.to_csv(temporary, index=False)
