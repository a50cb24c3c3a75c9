"""The stages that turn AugMERL into NeuMERL: the first field, the shards, the gathering."""

import logging

import h5py
import numpy as np
import torch

from neumat.augment.manifest import read_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.augment.store import AugMerl
from neumat.errors import NeumatError
from neumat.fields.fit import GROUP, Directions, first_field, fit
from neumat.fields.layout import SIZE, permute_channels
from neumat.fields.shards import read_shard, write_shard
from neumat.fields.store import PER_MATERIAL, read_first, write_neumerl
from neumat.files import atomic_path, reading

SHARD = "a shard of fits"


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
    if not torch.isfinite(weights).all():
        raise NeumatError(f"the first field, of {store.sources.names[0]}", "finite weights", "NaN")
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["weights"] = weights.numpy()


def fit_shard(store_path, sources_path, first_path, indices, config, seed, path, progress=iter):
    """Fit the materials `indices` and write weights, losses and flags: one shard of NeuMERL.

    With `independent: false` indices are multiples of 6: permutations follow exactly.
    """
    store = AugMerl(store_path, sources_path)
    directions = Directions(store.entries, seed)
    first = read_first(first_path)
    groups = [indices[k : k + GROUP] for k in range(0, len(indices), GROUP)]
    results = [fit(load_values(store, group), directions, first, config, seed) for group in progress(groups)]
    for group, result in zip(groups, results, strict=True):
        _check_finite(group, result)
    write_shard(path, indices, results, config)


def _check_finite(indices, result):
    """Raise NeumatError, naming the materials by number, where fits of them hold NaN or infinity."""
    finite = [torch.isfinite(result[key]).view(len(indices), -1).all(1) for key in ("weights", "loss_grid")]
    bad = [index for index, good in zip(indices, torch.stack(finite).all(0), strict=True) if not good]
    if bad:
        raise NeumatError(f"fits of the materials {', '.join(map(str, bad))} of the manifest", "finite losses", "NaN")


def fit_gather(shard_paths, manifest_path, path):
    """Gather the shards into the NeuMERL store, deriving the permutations that were not fitted themselves.

    A fit that has not converged stays in the store, flagged, and the log names it: what is shown and measured is shown
    and measured of it too, but no model is trained on it (`generative.dataset.training_indices`). Raises NeumatError
    for a shard that is damaged or holds a number that is not finite, and for a material that no shard has.
    """
    manifest = read_manifest(manifest_path)
    weights = torch.full((len(manifest), SIZE), torch.nan)
    fits = {key: np.zeros(len(manifest)) for key in PER_MATERIAL}
    count = len(PERMUTATIONS)
    for shard_path in shard_paths:
        arrays, config = read_shard(shard_path, SHARD)
        with reading(shard_path, SHARD):
            steps = range(1) if config["independent"] else range(count)
            for p in steps:
                index = arrays["index"] + p
                weights[index] = permute_channels(torch.from_numpy(arrays["weights"]), PERMUTATIONS[p])
                for key in PER_MATERIAL:
                    fits[key][index] = arrays[key]
    missing = int(weights.isnan().any(1).sum())
    if missing:
        raise NeumatError(path, "finite weights of every material", f"{missing} without")
    bad = manifest["name"][(fits["converged"] == 0) & (manifest["permutation"] == PERMUTATIONS[0])]
    if len(bad):
        logging.warning("%d fits have not converged, no model is trained on them: %s", len(bad), ", ".join(bad))
    write_neumerl(path, manifest, weights, fits, config)
