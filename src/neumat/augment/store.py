"""The AugMERL store: 400 base materials in factored form, served as tables or as any subset of entries.

A blend interpolates two sources linearly in PCA space. Projection is linear too, so a blend is the same mixture of
its parents' projections: the store holds the projected source columns (3N, V), float16, contiguous, and each base
material needs those of two sources. The sources themselves stay as measured, in the source store beside it.
"""

import h5py
import numpy as np

from neumat.augment.permutations import PERMUTATIONS, channel_order
from neumat.brdf.coordinates import ENTRIES
from neumat.brdf.merl import write_merl
from neumat.brdf.sources import BLOCK, LARGEST, channels, read_sources
from neumat.errors import NeumatError
from neumat.files import atomic_path, finite_halves, open_store, reading, text_attribute

SCHEMA = 1
WHAT = "an AugMERL store"
MEMBERS = {"parents": ("integers", ("n", 2)), "weight": ("numbers", ("n",)), "columns": ("halves", ("c", "v"))}


class AugMerl:
    """An open AugMERL store and the source store that it was made from.

    Attributes: n (base materials), entries (V,) flat MERL indices, parents (n, 2) source numbers, weight (n,).
    Raises NeumatError for a missing file, another schema version, or a source store that it was not made from.
    """

    def __init__(self, path, sources_path):
        self.path, self.sources = path, read_sources(sources_path)
        self._file = open_store(path, WHAT, MEMBERS, SCHEMA)
        with reading(path, WHAT):
            self.parents, self.weight = self._file["parents"][:], self._file["weight"][:]
        if text_attribute(self._file, path, WHAT, "sources") != self.sources.digest:
            raise NeumatError(path, "the source store that it was made from", sources_path)
        self.entries, self.n = self.sources.entries, len(self.parents)
        shape, expected = self._file["columns"].shape, (3 * self.sources.n, len(self.entries))
        if shape != expected:
            raise NeumatError(path, f"columns of shape {expected}", shape)
        if not ((self.parents >= 0) & (self.parents < self.sources.n)).all():
            raise NeumatError(path, f"parents among {self.sources.n} sources", "others")
        if not ((self.weight >= 0) & (self.weight <= 1)).all():
            raise NeumatError(path, "weights within 0..1", "others")

    def table(self, index):
        """Return material `index` = base * 6 + permutation at all entries, (V, 3) float32, 1/sr."""
        return self.values(index, slice(None))

    def values(self, index, positions):
        """Return material `index` at `positions` (m,) within `entries`, (m, 3) float32, 1/sr."""
        base, permutation = divmod(index, len(PERMUTATIONS))
        a, b = self.parents[base]
        if a == b:
            mixed = self.sources.values(a, positions)
        else:
            mixed = self.blend(a, b, np.float32(self.weight[base]), positions)
        return mixed[:, channel_order(PERMUTATIONS[permutation])]

    def blend(self, a, b, weight, positions):
        """Return the blend in PCA space of sources `a` and `b`, of which a has `weight`, as `values` does."""
        mixed, other = (self._projected(parent, positions) for parent in (a, b))
        mixed *= weight
        other *= 1 - weight
        mixed += other
        return mixed.T

    def _projected(self, source, positions):
        """Return a source as blends are made of it, (3, m) float32."""
        return channels(self.path, WHAT, self._file["columns"], source, positions)

    def materialise(self, index, path):
        """Write material `index` as a dense MERL `.binary` file."""
        dense = np.full((ENTRIES, 3), np.nan, np.float32)
        dense[self.entries] = self.table(index)
        write_merl(path, dense)


def write_store(path, sources, coefficients, parents, weight, attributes):
    """Write the store; return (negative share, mean and largest |change| of log(1 + f)) of the projected columns.

    coefficients: (3N, 3N) from `augment.pca.projection`. Entries that truncation drives below 0 are set to 0:
    reflectance is never negative, and mixtures of such columns cannot become so.
    """
    count = len(sources.entries)
    negative, changed, largest = 0, 0.0, 0.0
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["parents"], file["weight"] = parents, weight
        file.attrs.update(schema_version=SCHEMA, sources=sources.digest, **attributes)
        columns = file.create_dataset("columns", (len(coefficients), count), np.float16)
        for start in range(0, count, BLOCK):
            exact = sources.column_block(start, start + BLOCK).astype(np.float32)
            projected = coefficients @ exact.astype(np.float64)
            negative += int((projected < 0).sum())
            projected = projected.clip(0)
            with np.errstate(over="ignore"):
                stored = projected.astype(np.float16)
            if not finite_halves(stored):
                largest = f"{projected.max():.6g}"
                raise NeumatError(path, f"projected sources of at most {LARGEST:.0f} / sr", largest)
            columns[:, start : start + BLOCK] = stored
            change = np.abs(np.log1p(projected) - np.log1p(exact))
            changed += change.sum()
            largest = max(largest, float(change.max()))
    total = count * len(coefficients)
    return negative / total, changed / total, largest
