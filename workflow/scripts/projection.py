"""One space for texts and images, trained on the captions and pictures of the training materials."""

from safetensors.torch import save_file

from neumat.augment.manifest import protocol_indices, read_manifest
from neumat.conditions.projection import Projection
from neumat.conditions.store import read_conditions
from neumat.files import atomic_path
from neumat.stage import progress, stage

with stage(snakemake):
    params = snakemake.params
    conditions = read_conditions(snakemake.input.conditions)
    train, _ = protocol_indices(read_manifest(snakemake.input.manifest), params.protocol)
    projection = Projection.fit(
        conditions.encoder, conditions.text[train], conditions.image[train], **params.projection,
        seed=params.seed, progress=progress,
    )  # fmt: skip
    with atomic_path(snakemake.output[0]) as temporary:
        save_file(projection.state, temporary, {"encoder": projection.encoder})
