"""The store of the dense set: its recipe, its weight vectors, and how well each fits."""

import json
from dataclasses import dataclass

import h5py
import numpy as np
import pandas as pd
import torch

from neumat.augment.dense import COLUMNS, MIXING, PARENTS, WEIGHTS
from neumat.fields.layout import WIDTHS
from neumat.fields.store import FITS, PER_MATERIAL
from neumat.files import atomic_path, read_store

SCHEMA = 1
WHAT = "a store of dense fields"
TEXTS = {"names": ["base"], "parents": PARENTS, "grouped": ["grouped"]}  # dataset: columns of the recipe
NUMBERS = {"shares": WEIGHTS, "logarithmic": ["logarithmic"], "brightness": ["brightness"], "mixing": MIXING}
MEMBERS = FITS | {name: ("text", ("n", len(columns))) for name, columns in TEXTS.items()}
MEMBERS |= {name: ("numbers", ("n", len(columns))) for name, columns in NUMBERS.items()}


@dataclass
class DenseFields:
    """rows: the recipe, DataFrame with `augment.dense.COLUMNS`; weights (n, 675) float32 tensor; fits: dict of (n,)
    arrays."""

    rows: pd.DataFrame
    weights: torch.Tensor
    fits: dict


def write_dense(path, rows, weights, fits, config):
    """Write the fields (n, 675) of the dense bases `rows` and `fits` (PER_MATERIAL -> (n,)); config: of the fits."""
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["weights"] = np.asarray(weights, np.float32)
        for name, columns in TEXTS.items():
            file[name] = rows[columns].to_numpy(object).astype(h5py.string_dtype())
        for name, columns in NUMBERS.items():
            file[name] = rows[columns].to_numpy(np.float64)
        for key in PER_MATERIAL:
            file[key] = np.asarray(fits[key], bool if FITS[key][0] == "flags" else float)
        file.attrs.update(schema_version=SCHEMA, widths=WIDTHS, layout="W1 b1 W2 b2 W3 b3, kernels (in, out)")
        file.attrs["config"] = json.dumps(config)


def read_dense_fields(path):
    """Return the DenseFields in `path`; raises NeumatError where `files.read_store` does."""
    arrays, _ = read_store(path, WHAT, MEMBERS, SCHEMA)
    columns = {}
    for name, names in (TEXTS | NUMBERS).items():
        columns |= dict(zip(names, arrays[name].T, strict=True))
    rows = pd.DataFrame(columns)[COLUMNS].astype({"logarithmic": int})
    return DenseFields(rows, torch.from_numpy(arrays["weights"]).float(), {key: arrays[key] for key in PER_MATERIAL})
