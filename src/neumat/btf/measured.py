"""Users' own measured BTFs, read into a store: UBO2014's `.btf` files, and pictures as UBO2003 and ATRIUM have them."""

import logging
import os
import shutil
from pathlib import Path

import torch

from neumat.btf.bonn import read_bonn
from neumat.btf.conventions import Witness
from neumat.btf.store import read_btf, write_btf
from neumat.btf.ubo2003 import read_ubo2003
from neumat.errors import NeumatError

SIZE_MM = 100.0  # of a side, where neither the files nor the user tell
ROWS = ("down", "up")


def read_measured(path, out, cosine=True, rows="down", scale=None, size_mm=None, gamma=2.2, progress=iter):
    """Read a measured BTF into a store of pictures at `out`, and return the store, a BtfStore.

    path: a `.btf` file (see `neumat.btf.bonn`), or a folder or zip of pictures (see `neumat.btf.ubo2003`).
    cosine: whether the files' values contain the cosine of the light, as UBO2014's and pictures do; the store's always
    do. rows: "down" where a picture's first row is at its top, +y, as UBO2003's, or "up". scale: what values are
    multiplied by to get 1/sr; None: 1, and 1 / pi for JPEGs. size_mm: of a side; None: as the file says, else 100.
    gamma: of JPEGs. progress wraps the blocks of pictures.

    What was assumed is logged, with a warning where the pictures contradict it. Raises NeumatError, with nothing
    written, where the readers do, for other options, and for a disk without room for the store.
    """
    path, out = Path(path), Path(out)
    for name, value in (("scale", scale), ("size_mm", size_mm), ("gamma", gamma)):
        if value is not None and not 0 < value < float("inf"):
            raise NeumatError(path, f"{name}: a number above 0", value)
    if rows not in ROWS:
        raise NeumatError(path, f"rows: one of {', '.join(ROWS)}", rows)
    said = ""
    if path.suffix.lower() == ".btf":
        pictures, flag = read_bonn(path)
        said = f" (its header says that they {'do' if flag else 'do not'})"
    elif os.path.isdir(path) or path.suffix.lower() == ".zip":
        pictures = read_ubo2003(path, gamma)
    else:
        raise NeumatError(
            path, "a .btf file, or a folder or .zip of pictures", "neither" if os.path.exists(path) else "no such file"
        )
    _check_room(out, 6 * len(pictures.light) * pictures.side**2)
    scale = pictures.scale if scale is None else scale
    size_mm = size_mm or pictures.size_mm or SIZE_MM
    assumed = (
        f"values {'contain' if cosine else 'do not contain'} the cosine of the light{said}; rows run {rows}; "
        f"values times {scale:.4g} are 1/sr; a side is {size_mm:.4g} mm"
    )
    logging.info("%s: assumed: %s", path, assumed)
    witness = Witness(pictures.light, pictures.view, pictures.side)
    factor = scale * (torch.ones(len(pictures.light)) if cosine else pictures.light[:, 2])

    def values():
        for part in progress(pictures.blocks()):
            block = pictures.read(part)
            block = block if rows == "down" else block.flip(1)
            witness.add(part, block)
            yield block * factor[part, None, None, None]

    write_btf(
        out,
        pictures.light[:, None],
        pictures.view[:, None],
        pictures.side,
        pictures.side,
        values(),
        kind="pictures",
        cosine=True,
        size_mm=size_mm,
        partial=pictures.partial,
        source=f"{pictures.source}; {assumed}",
    )
    for text in witness.contradictions(cosine):
        logging.warning("%s: %s", path, text)
    return read_btf(out)


def _check_room(out, size):
    """Raise NeumatError where the disk of `out` has no room for `size` bytes."""
    folder = next(parent for parent in out.absolute().parents if os.path.isdir(parent))
    free = shutil.disk_usage(folder).free
    if size > free:
        raise NeumatError(out, f"room for {size / 1e9:.3g} GB", f"{free / 1e9:.3g} GB free")
