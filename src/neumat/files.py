"""Files that are either whole or absent, and stores that say what they are."""

import contextlib
import errno
import os
from pathlib import Path

import h5py

from neumat.errors import NeumatError


@contextlib.contextmanager
def atomic_path(path):
    """Yield a temporary path beside `path`; rename it on success, remove it on any failure.

    Raises NeumatError where the disk is full, with nothing left behind.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        # HDF5 reports a full disk in its message only, without errno.
        if error.errno == errno.ENOSPC or "No space left" in str(error):
            raise NeumatError(path, "room on the disk to write it", "a full disk") from error
        raise
    finally:
        temporary.unlink(missing_ok=True)


def open_store(path, what, member, schema):
    """Open a store (HDF5) for reading and return the h5py.File.

    Raises NeumatError for a missing, damaged or foreign file (without the dataset `member`) and for another schema
    version than `schema`.
    """
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        found = "a damaged or foreign file" if Path(path).is_file() else "no such file"
        raise NeumatError(path, f"{what} (HDF5)", found) from error
    version = file.attrs.get("schema_version")
    if member not in file or version != schema:
        found = f"version {version}" if member in file else "another kind of store"
        raise NeumatError(path, f"{what} of schema version {schema}", found)
    return file
