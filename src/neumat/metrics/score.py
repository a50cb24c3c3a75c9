"""The scores of one method under one protocol: every set metric on every distance, draw by draw."""

import pandas as pd

from neumat.errors import NeumatError
from neumat.metrics.distances import DISTANCES, Comparison, distance_tables
from neumat.metrics.frechet import frechet, kid
from neumat.metrics.materials import union
from neumat.metrics.sets import cov, mmd, one_nna

COLUMNS = ["method", "protocol", "draw", "metric", "distance", "value", "n_ref", "n_samples"]
PERCENT = 100


def score(reference, samples, draws, method, protocol, features, distances=tuple(DISTANCES)):
    """Return the scores of `samples`, cut into `draws` consecutive sets of equal size, as a DataFrame with COLUMNS.

    reference, samples: MaterialSet. Per draw: mmd in the distance's own unit, cov and one_nna in percent, for every
    named distance; the Frechet and kernel distances of the pictures by `features` ({name: pictures -> rows}), for
    which a broken material counts with whatever was drawn of it; and `nonfinite`, the number of broken samples.
    Raises NeumatError where the draws don't divide the samples.
    """
    size, rest = divmod(len(samples), draws)
    if rest or not size:
        raise NeumatError(f"samples of {method}", f"a multiple of {draws}, the number of draws", len(samples))
    of_reference = {name: extract(reference.images) for name, extract in features.items()}
    tables = _tables(reference, samples, size, distances)
    rows = []
    for draw in range(draws):
        part = samples[draw * size : (draw + 1) * size]
        results = _set_metrics(tables, draw)
        results.append(("nonfinite", "none", int((~part.finite).sum())))
        for name, extract in features.items():
            of_part = extract(part.images)
            results.append((f"Frechet-{name}", "features", frechet(of_reference[name], of_part)))
            results.append((f"KID-{name}", "features", kid(of_reference[name], of_part)))
        rows += [(method, protocol, draw, *result, len(reference), size) for result in results]
    return pd.DataFrame(rows, columns=COLUMNS)


def _tables(reference, samples, size, distances):
    """Return {name: (between reference and samples, within reference, [within each draw])} of every distance."""
    r = len(reference)
    both, first = union(reference, samples), slice(0, r)
    parts = [slice(start, start + size) for start in range(r, len(both), size)]
    compared = Comparison(both, [(first, slice(r, len(both))), (first, first), *zip(parts, parts, strict=True)])
    tables = {name: distance_tables(name, compared) for name in distances}
    return {name: (between, within, draws) for name, (between, within, *draws) in tables.items()}


def _set_metrics(tables, draw):
    results = []
    for name, (between, within, draws) in tables.items():
        own = draws[draw]
        between = between[:, draw * len(own) : (draw + 1) * len(own)]
        results += [
            ("mmd", name, mmd(between)),
            ("cov", name, PERCENT * cov(between)),
            ("one_nna", name, PERCENT * one_nna(between, within, own)),
        ]
    return results
