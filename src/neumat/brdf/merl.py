"""MERL `.binary` files (Matusik et al. 2003): 3 int32 dimensions, then planar R, G, B float64 in raw units.

Flat index: phi_d + 180 (theta_d + 90 theta_h). Entries that are not valid (`table.valid_entries`) are NaN in all that
is read here: below the horizon the files of different programs hold -1, 0, NaN or anything.
"""

import struct
from pathlib import Path

import numpy as np

from neumat.brdf.coordinates import ENTRIES, GRID, above_horizon
from neumat.brdf.names import measured_files
from neumat.brdf.table import checked, valid_entries
from neumat.errors import NeumatError
from neumat.files import atomic_path, reading

SUFFIX = ".binary"
HEADER = struct.Struct("<3i")
BYTES = HEADER.size + 3 * 8 * ENTRIES
SCALE = np.array([1.0, 1.15, 1.66]) / 1500  # raw units to 1/sr, for R, G, B


def check_merl(path):
    """Raise NeumatError where `path` has not the dimensions and size of MERL. Reads the header only."""
    path = Path(path)
    with reading(path, "a MERL file"):
        size = path.stat().st_size
        with path.open("rb") as file:
            header = file.read(HEADER.size)
    if len(header) < HEADER.size:
        raise NeumatError(path, f"a MERL file of {BYTES} bytes", f"{size} bytes")
    dimensions = HEADER.unpack(header)
    if dimensions != GRID:
        # Any small positive triple is a table of another resolution; anything else is another kind of file.
        plausible = all(0 < n <= 1000 for n in dimensions)
        found = f"dimensions {dimensions}" if plausible else "not a MERL file"
        raise NeumatError(path, f"a MERL file with dimensions {GRID}", found)
    if size != BYTES:
        found = "a truncated file" if size < BYTES else "a file that is too long"
        raise NeumatError(path, f"{BYTES} bytes", f"{found} of {size} bytes")


def read_merl(path):
    """Return the table of a MERL file: (1458000, 3) float32, 1/sr, NaN at invalid entries.

    Raises NeumatError for a missing, truncated or foreign file, wrong dimensions, a table of which fewer than half
    of the entries above the horizon are valid, and channels side by side: its numbers are not MERL's.
    """
    check_merl(path)
    with reading(path, "a MERL file"):
        raw = np.fromfile(path, dtype="<f8", offset=HEADER.size).reshape(3, ENTRIES)
    with np.errstate(over="ignore", invalid="ignore"):
        values = (raw.T * SCALE).astype(np.float32)
    if _marks_the_horizon(raw.reshape(ENTRIES, 3)):
        raise NeumatError(path, "three planes of R, G and B", "the channels side by side")
    return checked(path, values)


def _marks_the_horizon(rows):
    """Return whether raw values (1458000, 3) are negative or NaN below the horizon, as MERL's are, and only there.

    If they are, and are read in planes all the same, 56 % of the entries above the horizon look valid.
    """
    return ((rows >= 0).all(1) == above_horizon().numpy()).mean() > 0.95


def write_merl(path, values):
    """Write a table (1458000, 3), 1/sr, as a MERL file; an entry that is not valid becomes -1 in all channels."""
    values = np.asarray(values, dtype=np.float64)
    if values.shape != (ENTRIES, 3):
        raise NeumatError(path, f"a table of shape {(ENTRIES, 3)}", f"shape {values.shape}")
    raw = np.where(valid_entries(values)[:, None], values / SCALE, -1.0)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(HEADER.pack(*GRID))
        file.write(np.ascontiguousarray(raw.T, dtype="<f8").data)


def read_folder(folder, suffix=SUFFIX, check=check_merl):
    """Return {name: path} of a folder's measured files, see `measured_files`, each of which `check` (path) accepts."""
    files = measured_files(folder, suffix)
    for path in files.values():
        check(path)
    return files
