"""Shards of fits: what parallel jobs write, and one job gathers."""

import json

import h5py
import numpy as np
import torch

from neumat.fields.store import FITS, PER_MATERIAL
from neumat.files import atomic_path, read_store, reading


def write_shard(path, indices, results, config):
    """Write the fits of the materials `indices`: dicts of tensors, as `fit.fit` returns them, group by group."""
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["index"] = np.array(indices)
        for key in ("weights", *PER_MATERIAL):
            file[key] = torch.cat([result[key] for result in results]).numpy()
        file.attrs["config"] = json.dumps(config)


def read_shard(path, what):
    """Return (arrays by name: index and FITS, config) of a shard. what: it in words. Raises NeumatError for a file that
    is none."""
    arrays, attributes = read_store(path, what, FITS | {"index": ("integers", ("n",))})
    with reading(path, what):
        return arrays, json.loads(attributes["config"])
