"""The sphere renderer against Mitsuba, on source materials from matte to mirror."""

import torch

from neumat.augment.manifest import read_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.fields.field import evaluate
from neumat.fields.store import read_neumerl
from neumat.files import atomic_path
from neumat.render.sphere import FrozenSphere
from neumat.stage import stage
from neumat.studies.renderers import verify

with stage(snakemake):
    params = snakemake.params
    rows = read_manifest(snakemake.input.manifest)[:: len(PERMUTATIONS)]
    rows = rows[rows["parent_a"] == rows["parent_b"]]
    weights = read_neumerl(snakemake.input.neumerl).weights[torch.tensor(rows["index"].to_numpy())]
    # Ordered by the height of the highlight, evenly spread: the first is matte, the last a mirror.
    peak = evaluate(weights, torch.zeros(1), torch.full((1,), 0.5), torch.zeros(1)).mean((1, 2))
    chosen = peak.argsort()[torch.linspace(0, len(rows) - 1, params.materials).round().long()].unique_consecutive()
    names = rows["name"].iloc[chosen.numpy()]
    table = verify(FrozenSphere(params.size), dict(zip(names, weights[chosen], strict=True)), params.samples)
    with atomic_path(snakemake.output[0]) as temporary:
        table.to_csv(temporary, index=False)
