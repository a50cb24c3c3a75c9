"""Fit measured materials from the run's first field, as a user's own would be."""

from neumat.files import atomic_path
from neumat.stage import stage
from neumat.studies.measured_fits import fit_measured

with stage(snakemake):
    given, params = snakemake.input, snakemake.params
    table = fit_measured(given.files, given.first, params.fit, params.size, params.seed)
    with atomic_path(snakemake.output[0]) as path:
        table.to_csv(path, index=False)
