"""Files that are either whole or absent."""

import contextlib
import errno
import os
from pathlib import Path

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
