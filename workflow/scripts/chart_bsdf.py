"""Chart 4: the noise that each way of drawing directions leaves, against its time."""

from pathlib import Path

import torch

from neumat.augment.manifest import read_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.fields.store import read_neumerl
from neumat.files import atomic_path
from neumat.reporting.noise_chart import noise_chart
from neumat.stage import progress, stage
from neumat.studies.bsdf_sampling import by_kind, noise_sweep

with stage(snakemake):
    rows = read_manifest(snakemake.input.manifest)[:: len(PERMUTATIONS)]
    rows = rows[rows["parent_a"] == rows["parent_b"]]
    weights = read_neumerl(snakemake.input.neumerl).weights[torch.tensor(rows["index"].to_numpy())]
    materials = {kind: (rows["name"].iloc[i], weights[i]) for kind, i in by_kind(weights).items()}
    table = noise_sweep(materials, snakemake.params.samples, progress)
    with atomic_path(snakemake.output.table) as temporary:
        table.to_csv(temporary, index=False)
    noise_chart(table, Path(snakemake.output.table).with_suffix(""))
