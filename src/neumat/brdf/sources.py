"""The source materials of a run, gathered into one store.

sources.h5, schema 1: `names` (N,), `entries` (V,) int32 flat MERL indices that are valid in every source,
`columns` (3N, V) float16 with row 3i + c = channel c of source i, 1/sr, contiguous: a table is one read.
"""

import hashlib
import json
from pathlib import Path

import h5py
import numpy as np
import torch

from neumat.brdf.coordinates import ENTRIES, GRID, above_horizon
from neumat.brdf.download import download_merl
from neumat.brdf.merl import read_folder, read_merl
from neumat.brdf.names import chosen_names
from neumat.brdf.published import merl_checksums
from neumat.brdf.rgl import SUFFIX as RGL_SUFFIX
from neumat.brdf.rgl import check_rgl, read_rgl
from neumat.brdf.table import valid_entries
from neumat.errors import NeumatError
from neumat.files import atomic_path, finite_halves, open_store, reading, text_attribute

SCHEMA = 1
WHAT = "a store of sources"
MEMBERS = {"names": ("text", ("n",)), "entries": ("integers", ("v",)), "columns": ("halves", ("3n", "v"))}
BLOCK = 1 << 14  # entries at a time, of all columns
LARGEST = float(np.finfo(np.float16).max)


def _embedded(config):
    """The 100 MERL materials that come with the package."""
    from neumat.brdf.embedded import embedded_names, embedded_table

    available = embedded_names()
    names = chosen_names(available, config.get("names"))
    return names, (embedded_table(available.index(name)) for name in names)


def _merl(config):
    """MERL files in a folder; with a url, what is missing of the 100 is downloaded when it is read."""
    if config.get("url"):
        checksums = merl_checksums()
        names = chosen_names(checksums, config.get("names"))
        folder = _folder(config)
        return names, (read_merl(*download_merl([name], config["url"], folder, checksums)) for name in names)
    paths = read_folder(_folder(config))
    names = chosen_names(paths, config.get("names"))
    return names, (read_merl(paths[name]) for name in names)


def _rgl(config):
    """RGL files in a folder."""
    paths = read_folder(_folder(config), RGL_SUFFIX, check_rgl)
    names = chosen_names(paths, config.get("names"))
    return names, (read_rgl(paths[name]) for name in names)


# kind -> function(config section) -> (names, iterator of (1458000, 3) float32 tables, NaN at invalid entries)
SOURCES = {"embedded": _embedded, "merl": _merl, "rgl": _rgl}


def write_sources(config_sources, path, limit=None, progress=iter):
    """Write the store of the sources that the config section (kind, folder, url, names) describes.

    `limit` keeps the first so many names; `progress` wraps the list of names (tqdm). Holds 8.7 MB per source
    in memory. Raises NeumatError for bad input, for a value that float16 cannot hold, and where no entry is
    valid in all sources.
    """
    kind = config_sources["kind"]
    if kind not in SOURCES:
        raise NeumatError("sources.kind", f"one of {', '.join(SOURCES)}", repr(kind))
    names, tables = SOURCES[kind](config_sources)
    names = names[:limit]
    columns = np.empty((3 * len(names), ENTRIES), np.float16)
    valid = np.ones(ENTRIES, bool)
    for i, (name, table) in enumerate(zip(progress(names), tables, strict=False)):
        here = valid_entries(table)
        with np.errstate(over="ignore"):
            columns[3 * i : 3 * i + 3] = np.where(here[:, None], table, 0).T
        if not finite_halves(columns[3 * i : 3 * i + 3]):
            raise NeumatError(f"source {name}", f"values of at most {LARGEST:.0f} / sr", f"{table[here].max():.6g}")
        valid &= here
    entries = np.flatnonzero(valid).astype(np.int32)
    if not len(entries):
        raise NeumatError(path, "entries that are valid in every source", "not one")

    digest = hashlib.sha256(json.dumps(names).encode() + entries.tobytes())
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["names"] = names
        file["entries"] = entries
        stored = file.create_dataset("columns", (len(columns), len(entries)), np.float16)
        for row in range(0, len(columns), 3):
            block = columns[row : row + 3, entries]
            stored[row : row + 3] = block
            digest.update(block.tobytes())
        config = json.dumps(config_sources, sort_keys=True)
        file.attrs.update(schema_version=SCHEMA, kind=kind, config=config, digest=digest.hexdigest())


class Sources:
    """An open store of source materials.

    Attributes: names (list of N), entries (V,) int32, n = N, digest. Raises NeumatError for a missing file,
    one that is not a store of sources, and another schema version.
    """

    def __init__(self, path):
        self.path = path
        self._file = open_store(path, WHAT, MEMBERS, SCHEMA)
        with reading(path, WHAT):
            self.names = list(self._file["names"].asstr())
            self.entries = self._file["entries"][:]
        self.digest, self.n = text_attribute(self._file, path, WHAT, "digest"), len(self.names)
        rows = len(self._file["columns"])
        if rows != 3 * self.n:
            raise NeumatError(path, f"3 columns for each of {self.n} sources", rows)
        ascending = len(self.entries) and self.entries[0] >= 0 and (np.diff(self.entries) > 0).all()
        if not (ascending and self.entries[-1] < ENTRIES and above_horizon().numpy()[self.entries].all()):
            raise NeumatError(path, "ascending entries of the MERL grid above the horizon", "others")

    def column_block(self, start, stop):
        """Return the values of all sources at entries[start:stop]: (3N, stop - start) float16, 1/sr."""
        return read_columns(self.path, WHAT, self._file["columns"], (slice(None), slice(start, stop)))

    def table(self, i):
        """Return source i at all entries: (V, 3) float32, 1/sr."""
        return self.values(i, slice(None))

    def values(self, i, positions):
        """Return source i at `positions` (m,) within `entries`: (m, 3) float32, 1/sr."""
        return channels(self.path, WHAT, self._file["columns"], i, positions).T


def read_sources(path):
    """Open a store of sources; see Sources."""
    return Sources(path)


def channels(path, what, columns, i, positions):
    """Return rows 3i to 3i + 2 of the dataset `columns` (3N, V) float16 at `positions` (m,), (3, m) float32.

    path, what: of the store, for the NeumatError where a value can't be read or is not finite.
    """
    rows = read_columns(path, what, columns, slice(3 * i, 3 * i + 3))
    # torch turns half precision into single several times as fast as numpy.
    return torch.from_numpy(rows[:, positions]).float().numpy()


def read_columns(path, what, columns, part):
    """Return columns[part] of a dataset; raises NeumatError where a value can't be read or is not finite."""
    with reading(path, what):
        values = np.asarray(columns[part], np.float16)  # in the machine's order of bytes
    if not finite_halves(values):
        raise NeumatError(path, "finite reflectances", "NaN or infinite ones")
    return values


def gram(sources, stride=1):
    """Return the inner products of all source columns over every stride-th entry of each axis, (3N, 3N) float64.

    In float32 the sums lose what a PCA needs (reconstruction error 1e8 against 1e-3).
    """
    kept = np.all([index % stride == 0 for index in np.unravel_index(sources.entries, GRID)], axis=0)
    total = np.zeros((3 * sources.n, 3 * sources.n))
    for start in range(0, len(kept), BLOCK):
        block = sources.column_block(start, start + BLOCK)[:, kept[start : start + BLOCK]].astype(np.float64)
        total += block @ block.T
    return total


def _folder(config):
    if not config.get("folder"):
        raise NeumatError("sources.folder", f"a folder of {config['kind']} files", "none")
    return Path(config["folder"])
