"""The NeuMERL store: the weight vectors of all materials, and how well each fits."""

import json
from dataclasses import dataclass

import h5py
import numpy as np
import torch

from neumat.fields.layout import SIZE, WIDTHS
from neumat.files import atomic_path, read_store

SCHEMA = 1
PER_MATERIAL = ("loss_grid", "loss_uniform", "loss_constant", "converged", "retried")
# What a store holds of each fit, for `files.open_store`.
FITS = {
    "weights": ("numbers", ("n", SIZE)),
    **{key: ("numbers" if key.startswith("loss") else "flags", ("n",)) for key in PER_MATERIAL},
}
MEMBERS = FITS | {"names": ("text", ("n",)), "base": ("integers", ("n",)), "permutation": ("text", ("n",))}


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
        file["parents"] = manifest[["parent_a", "parent_b"]].to_numpy(object).astype(h5py.string_dtype())
        file["weight"] = manifest["weight"].to_numpy()
        for key in PER_MATERIAL:
            file[key] = np.asarray(fits[key], bool if FITS[key][0] == "flags" else float)
        file.attrs.update(schema_version=SCHEMA, widths=WIDTHS, layout="W1 b1 W2 b2 W3 b3, kernels (in, out)")
        file.attrs["config"] = json.dumps(config)


def read_neumerl(path):
    """Return the NeuMerl in `path`; raises NeumatError where `files.read_store` does."""
    arrays, _ = read_store(path, "a NeuMERL store", MEMBERS, SCHEMA)
    order = list(dict.fromkeys(arrays["permutation"]))
    return NeuMerl(
        weights=torch.from_numpy(arrays["weights"]).float(),
        names=list(arrays["names"]),
        base=arrays["base"],
        permutation=np.array([order.index(p) for p in arrays["permutation"]]),
        fits={key: arrays[key] for key in PER_MATERIAL},
    )


def read_first(path):
    """Return the first field (675,), from which all fits start; raises NeumatError where `files.read_store` does."""
    arrays, _ = read_store(path, "the first field", {"weights": ("numbers", (SIZE,))})
    return torch.from_numpy(arrays["weights"])


def read_requested(path):
    """Return the fields (n, 675), float32, that a run served to the texts and pictures that it reports.

    Raises NeumatError where `files.read_store` does.
    """
    members = {f"{name}/report/samples": ("numbers", (name, SIZE)) for name in ("text", "image")}
    arrays, _ = read_store(path, "a store of requested samples", members)
    return torch.from_numpy(np.concatenate([arrays[member] for member in members])).float()


def read_samples(path):
    """Return (weights (n, 675) float32 tensor, attributes) of a file of samples that are fields.

    Raises NeumatError where `files.read_store` does, so for samples of tables too.
    """
    arrays, attributes = read_store(path, "a store of samples", {"samples": ("numbers", ("n", SIZE))})
    return torch.from_numpy(arrays["samples"]).float(), attributes
