"""What materials may be called, and the measured files of a folder by name: the name of a material is its file's stem.

A name becomes a line of tables, a folder of results/export and a part of other names ("steel@rbg"), so what could not
come back letter for letter from any of these is refused before anything is read.
"""

import os
import re
from pathlib import Path

from neumat.errors import NeumatError

OURS = re.compile(r"(sample|blend|dense)-\d+", re.IGNORECASE)
SEPARATORS = "@/\\{}"  # permutations and ranks; folders; Snakemake's wildcards
LONGEST = 200  # bytes: a file system takes 255, to which suffixes are added


def check_name(name, where):
    """Raise NeumatError, naming `where` (a file or a config key), for a name that a material may not have."""
    if not name or not name.isprintable() or any(letter in SEPARATORS for letter in name):
        expected = f"a name of printable letters without {' '.join(SEPARATORS)}"
    elif name.startswith(".") or name != name.strip():
        expected = "a name that neither starts with a dot nor starts or ends with a space"
    elif len(name.encode()) > LONGEST:
        expected = f"a name of at most {LONGEST} bytes"
    elif OURS.fullmatch(name):
        expected = "a name unlike those of new materials: sample-<number>, blend-<number>, dense-<number>"
    else:
        return
    raise NeumatError(ascii(str(where))[1:-1], f"{expected} (rename it)", ascii(name))


def check_names(names, where):
    """Raise NeumatError for the first of `names` that a material may not have, or that is another's but for the case
    of its letters."""
    seen = {}
    for name in names:
        check_name(name, where)
        if twin := seen.get(name.casefold()):
            raise NeumatError(where, "a name of its own in any case of letters (rename one)", f"{twin} and {name}")
        seen[name.casefold()] = name


def measured_files(folder, suffix):
    """Return {name: path} of a folder's files of one kind, sorted by name, without opening any.

    Hidden files are ignored. Raises NeumatError for a missing or empty folder, a file of another kind among the files,
    a name that is refused, and two names that differ in case only.
    """
    folder = Path(folder)
    if not os.path.isdir(folder):  # Path.is_dir raises where a folder above may not be read
        raise NeumatError(folder, f"a folder of {suffix} files", "no such folder")
    try:
        paths = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError as error:
        raise NeumatError(folder, f"a folder of {suffix} files that can be read", error.strerror) from error
    if not paths:
        raise NeumatError(folder, f"a folder of {suffix} files", "an empty folder")
    seen = {}
    for path in paths:
        if path.suffix.lower() != suffix:
            raise NeumatError(path, f"only {suffix} files in the folder", "a file of another kind")
        check_name(path.stem, path)
        twin = seen.setdefault(path.stem.casefold(), path)
        if twin is not path:
            raise NeumatError(path, "a name of its own in any case of letters (rename one)", f"{twin.name} too")
    return {path.stem: path for path in sorted(paths, key=lambda path: path.stem)}


def chosen_names(available, names):
    """Return the config's `sources.names`, or all of `available` where it is null.

    Raises NeumatError for a name that is not at hand, one given twice, and an empty list.
    """
    if names is None:
        return list(available)
    for name in names:
        if name not in available:
            raise NeumatError("config key sources.names", "names of materials at hand", repr(name))
    if not names or len(set(names)) != len(names):
        raise NeumatError("config key sources.names", "different names, at least one", str(names))
    return list(names)
