"""Files that are either whole or absent, the cause where one can't be read, and stores that say what they are.

A store is an HDF5 file. Its reader names the datasets that it needs with their kinds and shapes, and gets them checked:
what passes is a store of the right kind, whatever happened to the file.
"""

import contextlib
import errno
import os
from pathlib import Path

import h5py
import numpy as np

from neumat.errors import NeumatError

# Kinds of datasets; text is a type of HDF5's own.
KINDS = {"numbers": np.floating, "halves": np.float16, "integers": np.integer, "flags": np.bool_, "text": None}


@contextlib.contextmanager
def atomic_path(path):
    """Yield a temporary path beside `path`; rename it on success, remove it on any failure.

    The file gets the mode that the umask leaves, whatever the library that writes it thinks of it. Raises NeumatError
    where nothing can be written there, and where the disk is full, with nothing left behind.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.touch()
        mode = temporary.stat().st_mode
        temporary.unlink()
    except OSError as error:
        raise NeumatError(path, "a place to write a file", os.strerror(error.errno).lower()) from error
    if path.is_dir():
        raise NeumatError(path, "a place to write a file", "a folder")
    try:
        yield temporary
        temporary.chmod(mode)
        os.replace(temporary, path)
    except OSError as error:
        # HDF5 reports a full disk in its message only, without errno.
        if error.errno == errno.ENOSPC or "No space left" in str(error):
            raise NeumatError(path, "room on the disk to write it", "a full disk") from error
        raise
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def reading(path, what):
    """Read `path`, which should be `what`, within this context: all that goes wrong is a NeumatError with its cause."""
    try:
        yield
    except NeumatError:
        raise
    except Exception as error:  # of broken files h5py, NumPy and safetensors raise nearly every kind
        raise NeumatError(path, what, cause(path, error)) from error


def cause(path, error):
    """Return in words why reading `path` raised `error`: what the system says of the file, else that it is damaged."""
    try:
        Path(path).open("rb").close()  # libraries don't tell a missing file from a forbidden one
    except (OSError, ValueError) as refused:
        error = refused
    match error:
        case FileNotFoundError() | NotADirectoryError():
            return "no such file"
        case IsADirectoryError():
            return "a folder"
        case PermissionError():
            return "a file that may not be read (permission denied)"
        case BlockingIOError():
            return "a file in use by another program"
        case OSError() if error.errno:
            return os.strerror(error.errno).lower()
    return "a damaged or foreign file"


def open_store(path, what, members, schema=None):
    """Open a store for reading and return the h5py.File.

    members: {dataset: (one of KINDS, shape)}, where a letter in a shape stands for a size that is the same everywhere.
    Raises NeumatError for a file that is missing, unreadable, damaged or foreign, for another schema version than
    `schema` (None: the store has none), and for a dataset of another kind or shape.
    """
    with reading(path, what):
        file = h5py.File(path, "r")
    try:
        with reading(path, what):
            _check(file, path, what, members, schema)
    except NeumatError:
        file.close()
        raise
    return file


def read_store(path, what, members, schema=None):
    """Return ({dataset: array}, {attribute: value}) of a store; text as str.

    Raises NeumatError where `open_store` does, and for numbers that are not finite.
    """
    with open_store(path, what, members, schema) as file, reading(path, what):
        arrays = {name: _values(file[name], kind) for name, (kind, _) in members.items()}
        attributes = {
            key: value.item() if isinstance(value, np.generic) else value for key, value in file.attrs.items()
        }
    for name, array in arrays.items():
        if members[name][0] == "numbers" and not np.isfinite(array).all():
            raise NeumatError(path, f"finite numbers in {name}", "NaN or infinite ones")
    return arrays, attributes


def _values(dataset, kind):
    """Return a dataset's values, text as str, numbers in the machine's order of bytes."""
    if kind == "text":
        return dataset.asstr()[()]
    return dataset[()].astype(dataset.dtype.newbyteorder("="), copy=False)


def finite_halves(values):
    """Return whether all of an array of float16 are finite: NumPy's isfinite takes ten times as long for them."""
    return not (values.view(np.uint16) & 0x7C00 == 0x7C00).any()


def text_attribute(file, path, what, name):
    """Return the text in an attribute of an open store; raises NeumatError where it is missing or no text."""
    with reading(path, what):
        value = file.attrs.get(name)
    if not isinstance(value, str):
        raise NeumatError(path, f"{what} with a text in its attribute {name}", repr(value))
    return value


def _check(file, path, what, members, schema):
    """Raise NeumatError where an open store is not as `open_store` says."""
    datasets = {name: file.get(name) for name in members}
    missing = [name for name, dataset in datasets.items() if not isinstance(dataset, h5py.Dataset)]
    if missing:
        raise NeumatError(path, what, f"another kind of store (no dataset {missing[0]})")
    version = file.attrs.get("schema_version")
    if version != schema:
        raise NeumatError(path, f"{what} of schema version {schema}", f"version {version}")
    sizes = {}
    for name, (kind, shape) in members.items():
        found, dtype = datasets[name].shape, datasets[name].dtype
        text = h5py.check_string_dtype(dtype) is not None
        if text != (kind == "text") or not (text or np.issubdtype(dtype, KINDS[kind])):
            raise NeumatError(path, f"{kind} in {name}", dtype)
        fits = found is not None and len(found) == len(shape)
        if fits:
            expected = [sizes.setdefault(n, m) if isinstance(n, str) else n for n, m in zip(shape, found, strict=True)]
            fits = expected == list(found)
        if not fits:
            expected = ", ".join(str(sizes.get(n, n)) for n in shape)
            raise NeumatError(path, f"{name} of shape ({expected})", f"shape {found}")
