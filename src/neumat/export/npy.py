"""Files of NumPy. A single one holds fields (n, 675), as a request's weights.npy does, or one (675,).

Neural-BRDF's set of `.npy` files (Sztrajman et al. 2021), which its Mitsuba plugin reads: <name>_fc1.npy (6, 21),
<name>_b1.npy (21), and so on to <name>_b3.npy (3); float32, kernels (in, out)."""

import re

import numpy as np
import torch

from neumat.errors import NeumatError
from neumat.export.parts import join, split
from neumat.fields.layout import SIZE
from neumat.files import atomic_path, reading

MEMBERS = ("fc1", "b1", "fc2", "b2", "fc3", "b3")
SUFFIX = f"_{MEMBERS[0]}.npy"  # of the file that stands for the set
PART = re.compile(rf"_({'|'.join(MEMBERS[1:])})\.npy$")  # the others


def write_npy(path, weights, metadata):
    """Write the six files of the field (675,) beside `path`, which ends in SUFFIX. The format has no metadata."""
    for file, part in zip(_files(path), split(weights), strict=True):
        with atomic_path(file) as temporary:
            np.save(temporary, part)


def read_rows(path):
    """Return the fields (n, 675), float32, of a file that holds n of them, or one (675,).

    Raises NeumatError for a missing or damaged file, another shape, other than floating-point numbers, and values that
    are not finite in single precision.
    """
    rows = _load(path)
    if rows.ndim not in (1, 2) or rows.shape[-1] != SIZE or not len(rows):
        raise NeumatError(path, f"weights of shape (n, {SIZE}) or ({SIZE},)", f"shape {rows.shape}")
    if not np.issubdtype(rows.dtype, np.floating):
        raise NeumatError(path, "floating-point numbers", rows.dtype)
    with np.errstate(over="ignore"):
        rows = rows.reshape(-1, SIZE).astype(np.float32)
    if not np.isfinite(rows).all():
        raise NeumatError(path, "finite weights", "NaN or infinite ones")
    return torch.from_numpy(rows)


def read_row(path):
    """Return the field (675,) of a file that holds one; raises NeumatError where `read_rows` does, and for several."""
    rows = read_rows(path)
    if len(rows) > 1:
        numbers = f"0 to {len(rows) - 1}"
        raise NeumatError(path, f"one material (`find_material` and the BSDF's `material` take {numbers})", len(rows))
    return rows[0]


def read_npy(path):
    """Return the field (675,) of the set of `path`, which ends in SUFFIX.

    Raises NeumatError for a missing or damaged member, and where `parts.join` does.
    """
    return join(path, {file.name: _load(file) for file in _files(path)})


def _files(path):
    """Return the paths of all members of the set of `path`."""
    return [path.with_name(f"{path.name[: -len(SUFFIX)]}_{member}.npy") for member in MEMBERS]


def _load(file):
    """Return the array of an .npy file, which np.load alone would also take for an archive of several."""
    with reading(file, "an .npy file"), open(file, "rb") as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)
