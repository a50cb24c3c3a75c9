"""Reciprocity and energy of the fitted materials and of the samples."""

import pandas as pd

from neumat.augment.permutations import PERMUTATIONS
from neumat.fields.physics import physics_table
from neumat.fields.store import read_neumerl, read_samples
from neumat.files import atomic_path
from neumat.stage import stage

with stage(snakemake):
    fitted = read_neumerl(snakemake.input.neumerl)
    # A material whose colours are permuted reflects as much.
    names, weights = fitted.names[:: len(PERMUTATIONS)], fitted.weights[:: len(PERMUTATIONS)]
    samples, _ = read_samples(snakemake.input.samples)
    tables = {
        "neumerl": physics_table(names, weights),
        "samples": physics_table([f"sample-{i}" for i in range(len(samples))], samples),
    }
    with atomic_path(snakemake.output[0]) as temporary:
        pd.concat(tables, names=["store"]).droplevel(1).to_csv(temporary)
