"""Materials that other programs, or `export`, have written."""

import os
from pathlib import Path

from neumat.brdf.merl import read_merl
from neumat.brdf.rgl import read_rgl
from neumat.brdf.table import Table
from neumat.errors import NeumatError
from neumat.export.keras import read_keras
from neumat.export.npy import PART, SUFFIX, read_npy, read_row
from neumat.export.safetensors import read_safetensors
from neumat.files import reading

# {suffix: function(path) -> weights (675,) or Table}
READERS = {
    ".binary": lambda path: Table(read_merl(path)),
    ".bsdf": lambda path: Table(read_rgl(path)),
    SUFFIX: read_npy,
    ".npy": read_row,
    ".h5": read_keras,
    ".safetensors": read_safetensors,
}


def read_material(path):
    """Return the material in `path`: its weights (675,), float32, or a `brdf.table.Table` where the format is a table.

    path: a file, for a set of .npy files the one that ends in _fc1.npy; or a folder that holds one such file. The
    suffix tells the format, and the reader checks the contents. What `export` wrote comes back exactly as weights, and
    to float32's rounding as a MERL table; a .bsdf is resampled onto the MERL grid, which changes log(1 + f) by less
    than 0.01 in the mean over its entries even for mirrors. `neumat.fields.fit` makes a field of a table. Raises
    NeumatError for a missing, damaged or foreign file, missing members, other shapes or widths, and values that are
    not finite.
    """
    path = Path(path)
    if os.path.isdir(path):  # Path.is_dir raises where a folder above may not be read
        path = _only_material(path)
    with reading(path, "a material"):
        path.open("rb").close()
    for suffix, read in READERS.items():
        if path.name.lower().endswith(suffix):
            return read(path)
    raise NeumatError(path, f"a file that ends in {', '.join(READERS)}", "another ending")


def _only_material(folder):
    """Return the one file of a folder that can be read."""
    with reading(folder, "a folder of one material"):
        names = sorted(path.name for path in folder.iterdir())
    known = [name for name in names if name.lower().endswith(tuple(READERS)) and not PART.search(name.lower())]
    found = [folder / name for name in known]
    if len(found) != 1:
        names = ", ".join(path.name for path in found[:3])
        raise NeumatError(folder, "one material in the folder", f"{len(found)} ({names})" if found else "none")
    return found[0]
