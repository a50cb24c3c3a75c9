"""What each model of a measured material costs and reaches, over all angles."""

import torch

from neumat.augment.manifest import read_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.augment.store import AugMerl
from neumat.fields.store import read_neumerl
from neumat.files import atomic_path
from neumat.stage import progress, stage
from neumat.studies.bsdf_sampling import by_kind
from neumat.studies.ladder import ladder_table

with stage(snakemake):
    rows = read_manifest(snakemake.input.manifest)[:: len(PERMUTATIONS)]
    rows = rows[rows["parent_a"] == rows["parent_b"]]
    index = torch.tensor(rows["index"].to_numpy())
    weights = read_neumerl(snakemake.input.neumerl).weights[index]
    chosen = by_kind(weights).values()
    materials = {rows["name"].iloc[i]: (int(index[i]), weights[i]) for i in chosen}
    first = next(field for i, field in enumerate(weights) if i not in chosen)
    store = AugMerl(snakemake.input.augmerl, snakemake.input.sources)
    params = snakemake.params
    table = ladder_table(store, materials, first, params.steps, params.size, params.samples, params.seed, progress)
    with atomic_path(snakemake.output[0]) as temporary:
        table.to_csv(temporary, index=False)
