"""What fits of dense bases cost against what they reach, beside fits as the paper's bases get them."""

import time

import numpy as np
import pandas as pd
import torch

from neumat.augment.dense import read_dense
from neumat.augment.permutations import PERMUTATIONS
from neumat.brdf.sources import read_sources
from neumat.fields.dense import fit_dense, load_dense, thinned
from neumat.fields.dense_store import read_dense_fields
from neumat.fields.fit import OUTLIER, Directions, fit, losses
from neumat.fields.interpolation import interpolated_fields
from neumat.fields.store import read_first, read_neumerl
from neumat.generative.orders import brightest_first
from neumat.generative.whitening import Coordinates
from neumat.seeds import torch_generator

MEANS = ("loss_grid", "loss_uniform", "converged")
SETS = ("validation", "reporting")
SHARES = (0.3, 0.6, 1.5)  # of the configured samples
OTHERS = (("batch_size", (256, 1024)), ("learning_rate", (0.003, 0.01)))
AXES = 256  # of the alignment error


def budgets(config):
    """Return [(method, config of `fit_dense`)]: the configured setting, then one change at a time."""
    dense = config["dense"]
    found = [("configured", config)]
    for share in SHARES:
        changed = dense | {"samples": int(share * dense["samples"])}
        found.append((f"{share:g} times the samples", config | {"dense": changed}))
    for key, values in OTHERS:
        for value in values:
            if value != dense[key]:
                found.append((f"{key.replace('_', ' ')} {value:g}", config | {"dense": dense | {key: value}}))
    return found


def dense_fits(recipe_path, dense_path, sources_path, neumerl_path, first_path, config, count, seed, progress=iter):
    """Return a DataFrame: method, samples, set, bases, seconds, loss_grid, loss_uniform, converged, alignment_error.

    config: the section `fit`; count: bases, spread over the recipe; the first half is for validation, on which
    `fit.dense` is chosen, the other reports. All methods see the same entries. seconds: of CPU a base, that of the
    interpolation included, that of making the values not; it has a row of its own. Losses: means over held-out entries;
    converged: share of the bases. The last row is the whole dense set as it was made.
    """
    fitted, rows, sources = read_neumerl(neumerl_path), read_dense(recipe_path), read_sources(sources_path)
    rows = rows.iloc[np.unique(np.linspace(0, len(rows) - 1, count).round().astype(int))]
    directions, positions = thinned(Directions(sources.entries, seed))
    alignment, first = Alignment(fitted.weights[:: len(PERMUTATIONS)]), read_first(first_path)

    start = time.process_time()
    values = load_dense(sources, rows, positions)
    loaded = time.process_time()
    begun = interpolated_fields(rows, fitted, neumerl_path)
    interpolation = time.process_time() - loaded
    table = [{"method": "values of the bases", "seconds": (loaded - start) / len(rows)}]

    def add(method, samples, seconds, result):
        for name, part in zip(SETS, torch.arange(len(rows)).tensor_split(2), strict=True):
            means = {key: result[key][part].double().mean().item() for key in MEANS}
            row = {"method": method, "samples": samples, "set": name, "bases": len(part)}
            error = alignment.error(result["weights"][part])
            table.append(row | {"seconds": seconds / len(rows)} | means | {"alignment_error": error})

    grid, uniform, null = losses(begun, values, directions, directions.held)
    untouched = {"weights": begun, "loss_grid": grid, "loss_uniform": uniform, "converged": grid < OUTLIER * null}
    add("interpolation alone", 0, interpolation, untouched)
    start = time.process_time()
    result = fit(values, directions, first, config, seed)
    samples = config["samples"] + config["polish"]["samples"]
    add("from the first field, as the paper's bases", samples, time.process_time() - start, result)
    for method, changed in progress(budgets(config)):
        start = time.process_time()
        result = fit_dense(values, directions, begun, changed, seed)
        seconds = time.process_time() - start + interpolation
        add(f"from interpolations, {method}", changed["dense"]["samples"], seconds, result)
    return pd.DataFrame([*table, whole_set(read_dense_fields(dense_path), config, alignment)])


def whole_set(store, config, alignment):
    """Return the row of all the DenseFields of a run: a dict of the table's columns, without seconds."""
    means = {key: store.fits[key].mean() for key in MEANS}
    row = {"method": "the dense set", "samples": config["dense"]["samples"], "set": "all", "bases": len(store.weights)}
    return row | means | {"alignment_error": alignment.error(store.weights)}


class Alignment:
    """How much of fields the principal axes of others tell: what is left, a model of the others has not seen.

    weights (n, 675): the others. Their AXES axes are those of weights in standard deviations, brightest channel first.
    """

    def __init__(self, weights):
        fields = brightest_first(weights)[0]
        self.deviation = fields.double().std(0)
        self.coordinates = Coordinates.fit(fields, AXES, "variance", 0.0, torch_generator(0, "alignment"))

    def error(self, weights):
        """Return the share of the squared deviation of fields (n, 675) from the others' mean that the axes leave."""
        fields = brightest_first(weights)[0]
        left, moved = fields - self.coordinates.decode(self.coordinates.encode(fields)), fields - self.coordinates.mean
        varies = self.deviation > 0
        left, moved = ((part.double() / self.deviation)[:, varies].square().sum() for part in (left, moved))
        return (left / moved).item()
