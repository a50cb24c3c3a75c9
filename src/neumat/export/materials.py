"""Finding the weights of a material by its name in a store."""

import difflib
import re

from neumat.errors import NeumatError
from neumat.export.npy import read_rows
from neumat.fields.store import read_neumerl, read_samples

SAMPLE = re.compile(r"sample-([0-9]{1,18})")


def find_material(store, name):
    """Return the weights (675,) of `name` in a NeuMERL store, of "sample-12" in a store of samples, or of the number
    "12" in a file weights.npy (n, 675), counted from 0.

    Raises NeumatError for an unknown name, with those that are nearest to it, and for a foreign store.
    """
    name = str(name)
    if str(store).lower().endswith(".npy"):
        return _row(store, name)
    match = SAMPLE.fullmatch(name)
    return _sample(store, name, int(match[1])) if match else _fitted(store, name)


def _fitted(store, name):
    fitted = read_neumerl(store)
    if name not in fitted.names:
        # Turns among the colours (chrome@rbg) would crowd out other materials.
        alike = [other for other in fitted.names if ("@" in other) == ("@" in name)]
        near = difflib.get_close_matches(name, alike, 3, 0)
        raise NeumatError(store, f"the name of a material, such as {', '.join(near)}", repr(name))
    return fitted.weights[fitted.names.index(name)]


def _row(path, name):
    rows = read_rows(path)
    if name not in map(str, range(len(rows))):
        raise NeumatError(path, f"the number of a material, 0 to {len(rows) - 1}", repr(name))
    return rows[int(name)]


def _sample(store, name, number):
    samples, _ = read_samples(store)
    if number >= len(samples):
        raise NeumatError(store, f"sample-0 to sample-{len(samples) - 1}", repr(name))
    return samples[number]
