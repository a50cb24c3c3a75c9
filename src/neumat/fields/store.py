"""The NeuMERL store: the weight vectors of all materials, and how well each fits."""

import json
from dataclasses import dataclass

import h5py
import numpy as np
import torch

from neumat.errors import NeumatError
from neumat.fields.layout import SIZE, WIDTHS
from neumat.files import atomic_path, open_store

SCHEMA = 1
PER_MATERIAL = ("loss_grid", "loss_uniform", "loss_constant", "converged", "retried")


@dataclass
class NeuMerl:
    """weights (n, 675) float32 tensor; names (n,); base (n,) int; permutation (n,) int; fits: dict of (n,) arrays."""

    weights: torch.Tensor
    names: list
    base: np.ndarray
    permutation: np.ndarray
    fits: dict


def write_neumerl(path, manifest, weights, fits, config):
    """Write weights (n, 675) and `fits` (PER_MATERIAL -> (n,)) of the manifest's materials, with their descent."""
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["weights"] = weights.numpy().astype(np.float32)
        file["names"] = list(manifest["name"])
        file["base"] = manifest.groupby("base", sort=False).ngroup().to_numpy()
        file["permutation"] = list(manifest["permutation"])
        file["parents"] = manifest[["parent_a", "parent_b"]].to_numpy().astype("S")
        file["weight"] = manifest["weight"].to_numpy()
        for key in PER_MATERIAL:
            file[key] = fits[key]
        file.attrs.update(schema_version=SCHEMA, widths=WIDTHS, layout="W1 b1 W2 b2 W3 b3, kernels (in, out)")
        file.attrs["config"] = json.dumps(config)


def read_neumerl(path):
    """Return the NeuMerl in `path`; raises NeumatError for a missing or foreign file and another schema version."""
    with open_store(path, "a NeuMERL store", "weights", SCHEMA) as file:
        if file["weights"].shape[1] != SIZE:
            raise NeumatError(path, f"{SIZE} weights a material", file["weights"].shape[1])
        permutation = file["permutation"].asstr()[:]
        order = list(dict.fromkeys(permutation))
        return NeuMerl(
            weights=torch.tensor(file["weights"][:]),
            names=list(file["names"].asstr()[:]),
            base=file["base"][:],
            permutation=np.array([order.index(p) for p in permutation]),
            fits={key: file[key][:] for key in PER_MATERIAL},
        )
