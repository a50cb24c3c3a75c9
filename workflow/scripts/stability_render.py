"""Drive rendering to where it breaks, and write down what happens there."""

from pathlib import Path
from tempfile import TemporaryDirectory

import torch

from neumat.augment.manifest import read_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.augment.store import AugMerl
from neumat.fields.store import read_neumerl
from neumat.files import atomic_path
from neumat.stability.render_bench import RenderBench
from neumat.stability.rendering import stability_table
from neumat.stage import progress, stage

with stage(snakemake):
    stores = snakemake.input
    rows = read_manifest(stores.manifest)[:: len(PERMUTATIONS)]
    rows = rows[rows["parent_a"] == rows["parent_b"]]  # blends are no measured materials
    indices = rows["index"].to_numpy()
    weights = read_neumerl(stores.neumerl).weights[torch.tensor(indices)]
    store = AugMerl(stores.augmerl, stores.sources)
    with TemporaryDirectory() as folder:
        bench = RenderBench(list(rows["name"]), weights, store, indices, Path(folder), snakemake.params.seed)
        table = stability_table(bench, progress)
    with atomic_path(snakemake.output[0]) as temporary:
        table.to_csv(temporary, index=False)
