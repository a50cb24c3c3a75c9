"""Reciprocity and energy of the fitted materials and of the samples."""

import h5py
import pandas as pd
import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.fields.physics import physics_table
from neumat.fields.store import read_neumerl
from neumat.files import atomic_path
from neumat.stage import stage

with stage(snakemake):
    fitted = read_neumerl(snakemake.input.neumerl)
    # A material whose colours are permuted reflects as much.
    names, weights = fitted.names[:: len(PERMUTATIONS)], fitted.weights[:: len(PERMUTATIONS)]
    with h5py.File(snakemake.input.samples) as file:
        samples = torch.from_numpy(file["samples"][:])
    tables = {
        "neumerl": physics_table(names, weights),
        "samples": physics_table([f"sample-{i}" for i in range(len(samples))], samples),
    }
    with atomic_path(snakemake.output[0]) as temporary:
        pd.concat(tables, names=["store"]).droplevel(1).to_csv(temporary)
