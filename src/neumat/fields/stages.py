"""The stages that turn AugMERL into NeuMERL: the first field, the shards, the gathering."""

import json

import h5py
import numpy as np
import torch

from neumat.augment.manifest import read_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.augment.store import AugMerl
from neumat.errors import NeumatError
from neumat.fields.fit import GROUP, Directions, first_field, fit
from neumat.fields.layout import SIZE, permute_channels
from neumat.fields.store import PER_MATERIAL, write_neumerl
from neumat.files import atomic_path


def load_values(store, indices):
    """Return the materials `indices` of an AugMerl at all entries, (V, K, 3) float16."""
    values = torch.empty(len(store.entries), len(indices), 3, dtype=torch.float16)
    for k, index in enumerate(indices):
        values[:, k] = torch.from_numpy(store.table(index)).half()
    return values


def fit_first(store_path, sources_path, config, seed, path, progress=iter):
    """Fit the first source material from random weights: what all other fits start from."""
    store = AugMerl(store_path, sources_path)
    directions = Directions(store.entries, seed)
    weights = first_field(load_values(store, [0]), directions, config, seed, progress=progress)
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["weights"] = weights.numpy()


def fit_shard(store_path, sources_path, first_path, indices, config, seed, path, progress=iter):
    """Fit the materials `indices` and write weights, losses and flags: one shard of NeuMERL.

    With `independent: false` indices are multiples of 6: permutations follow exactly.
    """
    store = AugMerl(store_path, sources_path)
    directions = Directions(store.entries, seed)
    with h5py.File(first_path) as file:
        first = torch.from_numpy(file["weights"][:])
    groups = [indices[k : k + GROUP] for k in range(0, len(indices), GROUP)]
    results = [fit(load_values(store, group), directions, first, config, seed) for group in progress(groups)]
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["index"] = np.array(indices)
        for key in ("weights", *PER_MATERIAL):
            file[key] = torch.cat([result[key] for result in results]).numpy()
        file.attrs["config"] = json.dumps(config)


def fit_gather(shard_paths, manifest_path, path):
    """Gather the shards into the NeuMERL store, deriving the permutations that were not fitted themselves."""
    manifest = read_manifest(manifest_path)
    weights = torch.full((len(manifest), SIZE), torch.nan)
    fits = {key: np.zeros(len(manifest)) for key in PER_MATERIAL}
    count = len(PERMUTATIONS)
    for shard_path in shard_paths:
        with h5py.File(shard_path) as file:
            config = json.loads(file.attrs["config"])
            index = file["index"][:]
            fitted = torch.from_numpy(file["weights"][:])
            steps = range(1) if config["independent"] else range(count)
            for p in steps:
                weights[index + p] = permute_channels(fitted, PERMUTATIONS[p])
                for key in PER_MATERIAL:
                    fits[key][index + p] = file[key][:]
    missing = int(weights.isnan().any(1).sum())
    if missing:
        raise NeumatError(path, "finite weights of every material", f"{missing} without")
    write_neumerl(path, manifest, weights, fits, config)
