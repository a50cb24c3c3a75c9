"""The scores of a method under one protocol: every set metric on every distance, draw by draw.

1-NNA and COV depend on the sizes of the sets, and so do Frechet distances: of 36 and 120 materials from one
distribution 1-NNA tells 65 % apart, and not half of them. So sets of one size are compared.
"""

import numpy as np
import pandas as pd
import torch

from neumat.errors import NeumatError
from neumat.metrics.distances import DISTANCES, Comparison, distance_tables
from neumat.metrics.frechet import frechet, kid
from neumat.metrics.materials import union
from neumat.metrics.sets import cov, mmd, one_nna
from neumat.seeds import numpy_generator

COLUMNS = ["method", "protocol", "draw", "metric", "distance", "value", "n_ref", "n_samples"]
PERCENT = 100
# A distance that is a monotone function of another one: neighbours are the same, and with them 1-NNA and COV.
MONOTONE = {"neg_psnr": "rmse"}


class Scorer:
    """The reference set of a protocol, against which sets of samples are scored.

    reference: MaterialSet; protocol: its name; features: {name: pictures -> rows}, for Frechet and kernel distances;
    distances: names of DISTANCES.
    """

    def __init__(self, reference, protocol, seed, features, distances=tuple(DISTANCES)):
        self.reference, self.protocol, self.seed = reference, protocol, seed
        self.features, self.distances = features, distances
        self.of_reference = {name: extract(reference.images) for name, extract in features.items()}

    def score(self, samples, draws, method):
        """Return the scores of `samples`, cut into `draws` consecutive sets of equal size, a DataFrame with COLUMNS.

        Where a draw and the reference set differ in size, as many of the larger as there are in the smaller are
        compared: the draw's first ones, or references drawn anew for each draw, the same ones for all methods. n_ref
        and n_samples say how many were compared. Per draw: mmd in the distance's own unit, cov and one_nna in percent,
        for every distance; the Frechet and kernel distances of the pictures by the features, for which a broken
        material counts with whatever was drawn of it; and `nonfinite`, the number of broken samples.
        Raises NeumatError where the draws don't divide the samples.
        """
        size, rest = divmod(len(samples), draws)
        if rest or not size:
            raise NeumatError(f"samples of {method}", f"a multiple of {draws}, the number of draws", len(samples))
        tables = self._tables(samples, size)
        rows = []
        for draw in range(draws):
            chosen = self._chosen(draw, size)
            compared = slice(draw * size, draw * size + len(chosen))
            part = samples[compared]
            results = _set_metrics(tables, draw, chosen, compared)
            results.append(("nonfinite", "none", int((~part.finite).sum())))
            for name, extract in self.features.items():
                sets = self.of_reference[name][chosen], extract(part.images)
                results.append((f"Frechet-{name}", "features", frechet(*sets)))
                results.append((f"KID-{name}", "features", kid(*sets)))
            rows += [(method, self.protocol, draw, *result, len(chosen), len(part)) for result in results]
        return pd.DataFrame(rows, columns=COLUMNS)

    def _chosen(self, draw, size):
        """Return the indices, ascending, of the references with which a draw of `size` samples is compared."""
        n = len(self.reference)
        if n <= size:
            return torch.arange(n)
        generator = numpy_generator(self.seed, "references of a draw", self.protocol, draw)
        return torch.from_numpy(np.sort(generator.permutation(n)[:size]))

    def _tables(self, samples, size):
        """Return {name: (between reference and samples, within reference, [within each draw])} of every distance."""
        r = len(self.reference)
        both, first = union(self.reference, samples), slice(0, r)
        parts = [slice(start, start + size) for start in range(r, len(both), size)]
        compared = Comparison(both, [(first, slice(r, len(both))), (first, first), *zip(parts, parts, strict=True)])
        tables = {name: distance_tables(name, compared) for name in self.distances}
        return {name: (between, within, draws) for name, (between, within, *draws) in tables.items()}


def _set_metrics(tables, draw, chosen, compared):
    """Return rows (metric, distance, value) of one draw: of the references `chosen` and the samples `compared`."""
    n, values = len(chosen), {}
    for name, (between, within, draws) in tables.items():
        between = between[chosen, compared]
        values["mmd", name] = mmd(between)
        if MONOTONE.get(name) in tables:
            continue
        values["cov", name] = PERCENT * cov(between)
        values["one_nna", name] = PERCENT * one_nna(between, within[chosen][:, chosen], draws[draw][:n, :n])
    metrics = ("mmd", "cov", "one_nna")
    return [(metric, name, _value(values, metric, name)) for name in tables for metric in metrics]


def _value(values, metric, name):
    return values[metric, name] if (metric, name) in values else values[metric, MONOTONE[name]]
