"""Chart 4: the noise that each way of drawing directions leaves, against its time."""

from pathlib import Path

import torch

from neumat.augment.manifest import read_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.fields.field import evaluate
from neumat.fields.store import read_neumerl
from neumat.files import atomic_path
from neumat.render.noise import noise_sweep
from neumat.reporting.noise_chart import noise_chart
from neumat.stage import progress, stage

RANKS = {"matte": 0.12, "satin": 0.5, "glossy": 0.8, "mirror": 1.0}  # among the sources, by height of the highlight

with stage(snakemake):
    rows = read_manifest(snakemake.input.manifest)[:: len(PERMUTATIONS)]
    rows = rows[rows["parent_a"] == rows["parent_b"]]
    weights = read_neumerl(snakemake.input.neumerl).weights[torch.tensor(rows["index"].to_numpy())]
    peak = evaluate(weights, torch.zeros(1), torch.full((1,), 0.5), torch.zeros(1)).mean((1, 2))
    chosen = {kind: int(peak.argsort()[round(rank * (len(rows) - 1))]) for kind, rank in RANKS.items()}
    materials = {kind: (rows["name"].iloc[i], weights[i]) for kind, i in chosen.items()}
    table = noise_sweep(materials, snakemake.params.samples, progress)
    with atomic_path(snakemake.output.table) as temporary:
        table.to_csv(temporary, index=False)
    noise_chart(table, Path(snakemake.output.table).with_suffix(""))
