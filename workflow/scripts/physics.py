"""Reciprocity and energy of fitted materials and of samples; what programs show of them that do not fold phi_d."""

import pandas as pd

from neumat.augment.permutations import PERMUTATIONS
from neumat.fields.physics import physics_table, unfolded_table
from neumat.fields.store import read_neumerl, read_requested, read_samples
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
    with atomic_path(snakemake.output.table) as temporary:
        pd.concat(tables, names=["store"]).droplevel(1).to_csv(temporary)
    sets = {"fitted": weights, "sampled": samples, "requested": read_requested(snakemake.input.requested)}
    with atomic_path(snakemake.output.unfolded) as temporary:
        unfolded_table(sets).to_csv(temporary, index=False)
