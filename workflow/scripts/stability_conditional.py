"""Drive synthesis on demand to where it breaks, and write down what happens there."""

import torch

from neumat.conditions.synthesis import Synthesiser
from neumat.conditions.training import PROTOCOL
from neumat.files import atomic_path
from neumat.metrics.novelty import NOVELTY_ENTRIES
from neumat.stability.request_bench import StressBench
from neumat.stability.requests import stability_table
from neumat.stage import progress, stage
from neumat.studies.protocols import Protocol

PICTURES = 16  # pixels; none is drawn

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    protocol = Protocol(PROTOCOL, store.neumerl, store.manifest, store.sources, params.entries, PICTURES, params.seed)
    entries = protocol.entries[:: max(1, params.entries // NOVELTY_ENTRIES)]
    training = protocol.weights[torch.as_tensor(protocol.train)]
    bench = StressBench(Synthesiser.load(store.model), entries, training, params.guidance, params.seed)
    table = stability_table(bench, progress)
    with atomic_path(snakemake.output[0]) as temporary:
        table.to_csv(temporary, index=False)
