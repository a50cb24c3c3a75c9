"""MERL `.binary` files (Matusik et al. 2003): 3 int32 dimensions, then planar R, G, B float64 in raw units.

Flat index: phi_d + 180 (theta_d + 90 theta_h). Entries that are negative in any channel were not measured or
lie below the horizon: they are invalid, and NaN in everything that is read here.
"""

import struct
from pathlib import Path

import numpy as np

from neumat.brdf.coordinates import ENTRIES, GRID
from neumat.brdf.names import measured_files
from neumat.errors import NeumatError
from neumat.files import atomic_path

SUFFIX = ".binary"
HEADER = struct.Struct("<3i")
BYTES = HEADER.size + 3 * 8 * ENTRIES
SCALE = np.array([1.0, 1.15, 1.66]) / 1500  # raw units to 1/sr, for R, G, B


def check_merl(path):
    """Raise NeumatError where `path` has not the dimensions and size of MERL. Reads the header only."""
    path = Path(path)
    if not path.is_file():
        raise NeumatError(path, "a MERL file", "no such file")
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

    Raises NeumatError for a missing, truncated or foreign file, wrong dimensions, values that are not finite,
    and a table without one valid entry.
    """
    check_merl(path)
    raw = np.fromfile(path, dtype="<f8", offset=HEADER.size).reshape(3, ENTRIES)
    broken = np.count_nonzero(~np.isfinite(raw))
    if broken:
        raise NeumatError(path, "finite values", f"{broken} that are NaN or infinite")
    valid = (raw >= 0).all(axis=0)
    if not valid.any():
        raise NeumatError(path, "a table with valid entries", "negative values in every entry")
    return np.where(valid[:, None], raw.T * SCALE, np.nan).astype(np.float32)


def write_merl(path, values):
    """Write a table (1458000, 3), 1/sr, as a MERL file; an entry with a NaN becomes -1 in all channels."""
    values = np.asarray(values, dtype=np.float64)
    if values.shape != (ENTRIES, 3):
        raise NeumatError(path, f"a table of shape {(ENTRIES, 3)}", f"shape {values.shape}")
    raw = np.where(np.isnan(values).any(axis=1, keepdims=True), -1.0, values / SCALE)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(HEADER.pack(*GRID))
        file.write(np.ascontiguousarray(raw.T, dtype="<f8").data)


def read_folder(folder, suffix=SUFFIX, check=check_merl):
    """Return {name: path} of a folder's measured files, see `measured_files`, each of which `check` (path) accepts."""
    files = measured_files(folder, suffix)
    for path in files.values():
        check(path)
    return files
