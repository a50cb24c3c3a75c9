"""The store of a captured or measured BTF: sweeps of values, and the directions of light and view of each.

    values (s, H, W, 3) float16: s sweeps, each a picture in which every texel is seen once
    light, view (s, p, 3) float32: texel number t = i W + j of a sweep belongs to its pair t mod p
    attributes: schema_version, kind, units, cosine, size_mm, extent, tileable, partial, surface, source, samples

A store of "pictures" has one pair a sweep; one of random "queries" has hundreds, different in each. Values are
reflectance, 1/sr, linear RGB, times the cosine of the light where `cosine` is true. Texel (i, j) covers
[j / W, (j + 1) / W) x [i / H, (i + 1) / H) of `extent` times the exemplar's side, and its value is the mean over that.
"""

import json
import math
from dataclasses import dataclass, field

import h5py
import numpy as np
import torch

from neumat.errors import NeumatError
from neumat.files import atomic_path, finite_halves, open_store, reading

SCHEMA = 1
WHAT = "a BTF store"
KINDS = ("queries", "pictures")
MEMBERS = {
    "values": ("halves", ("s", "h", "w", 3)),
    "light": ("numbers", ("s", "p", 3)),
    "view": ("numbers", ("s", "p", 3)),
}
LARGEST = float(np.finfo(np.float16).max)


@dataclass
class BtfStore:
    """A BTF that is read sweep by sweep, from its file or from memory.

    light, view (s, p, 3) float32; height, width in texels; size_mm: side of the exemplar, mm; extent: sides of the
    exemplar along a side of the values; surface: the surface's config, or None; samples: paths a value; partial: of a
    measured set, whether views are missing; source: a text.
    """

    light: torch.Tensor
    view: torch.Tensor
    height: int
    width: int
    kind: str = "queries"
    cosine: bool = True
    size_mm: float = 1.0
    extent: float = 1.0
    tileable: bool = False
    partial: bool = False
    surface: dict | None = None
    source: str = ""
    samples: int = 1
    _read: object = field(default=None, repr=False)

    @classmethod
    def from_arrays(cls, values, light, view, **attributes):
        """Return the BTF of values (s, H, W, 3) and directions (s, p, 3), arrays or tensors, kept in memory."""
        values, light, view = (torch.as_tensor(array) for array in (values, light, view))
        store = cls(light.float(), view.float(), *values.shape[1:3], **attributes)
        _check(store, WHAT)
        halves = values.half()
        store._read = lambda indices: halves[indices]
        return store

    @property
    def sweeps(self):
        """How many sweeps there are."""
        return len(self.light)

    @property
    def pairs(self):
        """How many pairs of directions a sweep has."""
        return self.light.shape[1]

    def values(self, indices):
        """Return the values (k, H, W, 3), float16, of sweeps (k,); raises NeumatError where they can't be read."""
        return self._read(torch.as_tensor(indices).long())


def attributes(store):
    """Return the attributes of a BtfStore that are not its arrays, as `write_btf` takes them."""
    names = ("kind", "cosine", "size_mm", "extent", "tileable", "partial", "surface", "source", "samples")
    return {name: getattr(store, name) for name in names}


def write_btf(path, light, view, height, width, blocks, **attributes):
    """Write a store to `path`; only one block of values is held at a time.

    light, view: (s, p, 3) tensors or arrays; blocks: an iterable of values (..., width, 3), 1/sr, that hold the rows of
    the sweeps one after the other: whole sweeps, or bands of rows; or of (sweep, row, column, values (k, h, w, 3)), in
    any order, where the first three say where in the store the values begin. attributes: those of BtfStore. Values
    beyond float16's largest are stored as that. Raises NeumatError for directions that are no unit vectors, pairs that
    don't divide the texels, values that are negative, NaN or infinite, and too few or too many of them.
    """
    light, view = (torch.as_tensor(directions, dtype=torch.float32) for directions in (light, view))
    store = BtfStore(light, view, height, width, **attributes)
    _check(store, path)
    texels = store.sweeps * height * width
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["light"], file["view"] = light.numpy(), view.numpy()
        data = file.create_dataset("values", (store.sweeps, height, width, 3), np.float16)
        file.attrs.update(
            schema_version=SCHEMA,
            units="1/sr",
            kind=store.kind,
            cosine=store.cosine,
            size_mm=float(store.size_mm),
            extent=float(store.extent),
            tileable=store.tileable,
            partial=store.partial,
            surface=json.dumps(store.surface) if store.surface else "",
            source=store.source,
            samples=store.samples,
        )
        written = 0
        for block in blocks:
            if isinstance(block, tuple):
                written += _write_part(path, data, *block)
            else:
                written += _write_rows(path, data, written // width, block)
        if written != texels:
            raise NeumatError(path, f"{texels} values", f"{written}")


def _halves(path, values):
    """Return values, an array or tensor, as an array of float16."""
    values = torch.as_tensor(values)
    if not (values.isfinite() & (values >= 0)).all():
        raise NeumatError(path, "finite values of at least 0", "negative, NaN or infinite ones")
    return values.clamp_max(LARGEST).half().numpy()


def _write_part(path, data, sweep, row, column, values):
    """Write values (k, h, w, 3) into the dataset (s, H, W, 3) from there on; return how many texels they are."""
    places = tuple(slice(first, first + n) for first, n in zip((sweep, row, column), values.shape[:3], strict=True))
    if any(place.stop > size for place, size in zip(places, data.shape, strict=False)):
        raise NeumatError(path, f"values within {data.shape[:3]}", f"up to {[place.stop for place in places]}")
    data[places] = _halves(path, values)
    return math.prod(values.shape[:3])


def _write_rows(path, data, first, block):
    """Write rows (..., W, 3) into the dataset (s, H, W, 3) from row number `first` of all on, as `_write_part` does."""
    sweeps, height, width = data.shape[:3]
    if block.shape[-2:] != (width, 3):
        raise NeumatError(path, f"values of shape (..., {width}, 3)", tuple(block.shape))
    rows = _halves(path, block).reshape(-1, width, 3)
    if first + len(rows) > sweeps * height:
        raise NeumatError(path, f"{sweeps * height * width} values", "more")
    done = 0
    while done < len(rows):
        sweep, row = divmod(first + done, height)
        count = min(height - row, len(rows) - done)
        data[sweep, row : row + count] = rows[done : done + count]
        done += count
    return done * width


def read_btf(path):
    """Return the BtfStore in a file; its values are read when asked for.

    Raises NeumatError for a file that is missing, damaged, foreign or of another version, and for directions and
    attributes that are none.
    """
    with open_store(path, WHAT, MEMBERS, SCHEMA) as file, reading(path, WHAT):
        light, view = (torch.from_numpy(file[name][()].astype(np.float32)) for name in ("light", "view"))
        height, width = file["values"].shape[1:3]
        found = {key: value.item() if isinstance(value, np.generic) else value for key, value in file.attrs.items()}
        if found["units"] != "1/sr":
            raise NeumatError(path, "values in 1/sr", repr(found["units"]))
        store = BtfStore(
            light,
            view,
            height,
            width,
            kind=str(found["kind"]),
            cosine=bool(found["cosine"]),
            size_mm=float(found["size_mm"]),
            extent=float(found["extent"]),
            tileable=bool(found["tileable"]),
            partial=bool(found["partial"]),
            surface=json.loads(found["surface"]) if found["surface"] else None,
            source=str(found["source"]),
            samples=int(found["samples"]),
        )
    _check(store, path)
    store._read = lambda indices: _read_sweeps(path, indices, (height, width))
    return store


def _read_sweeps(path, indices, size):
    """Return the values (k, H, W, 3) of sweeps (k,) of a store."""
    values = np.empty((len(indices), *size, 3), np.float16)
    with open_store(path, WHAT, MEMBERS, SCHEMA) as file, reading(path, WHAT):
        for k, index in enumerate(indices.tolist()):
            file["values"].read_direct(values, np.s_[index], np.s_[k])
    if not finite_halves(values):
        raise NeumatError(path, "finite values", "NaN or infinite ones")
    return torch.from_numpy(values)


def _check(store, where):
    """Raise NeumatError where a store's directions or attributes are none."""
    if store.light.dim() != 3 or store.light.shape[-1] != 3 or store.light.shape != store.view.shape:
        raise NeumatError(
            where, "light and view of one shape (s, p, 3)", f"{tuple(store.light.shape)} and {tuple(store.view.shape)}"
        )
    for name, directions in (("light", store.light), ("view", store.view)):
        length = torch.linalg.vector_norm(directions, dim=-1)
        if not ((length - 1).abs() < 1e-3).all():  # NaN is not below either
            raise NeumatError(where, f"unit vectors in {name}", "others")
    if store.pairs == 0 or store.height * store.width % store.pairs:
        found = f"{store.pairs} of {store.height} x {store.width}"
        raise NeumatError(where, "pairs of directions that divide the texels of a sweep", found)
    if store.kind not in KINDS:
        raise NeumatError(where, f"kind: one of {', '.join(KINDS)}", repr(store.kind))
    if store.kind == "pictures" and store.pairs != 1:
        raise NeumatError(where, "one pair of directions a picture", f"{store.pairs}")
    if not (0 < store.size_mm < np.inf and 0 < store.extent < np.inf and store.samples > 0):
        raise NeumatError(
            where, "size_mm, extent and samples above 0", f"{store.size_mm:g}, {store.extent:g}, {store.samples}"
        )
