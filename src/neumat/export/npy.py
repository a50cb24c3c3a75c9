"""Neural-BRDF's set of `.npy` files (Sztrajman et al. 2021), which its Mitsuba plugin reads: <name>_fc1.npy (6, 21),
<name>_b1.npy (21), and so on to <name>_b3.npy (3); float32, kernels (in, out)."""

import numpy as np

from neumat.export.parts import join, split
from neumat.files import atomic_path, reading

MEMBERS = ("fc1", "b1", "fc2", "b2", "fc3", "b3")
SUFFIX = f"_{MEMBERS[0]}.npy"  # of the file that stands for the set


def write_npy(path, weights, metadata):
    """Write the six files of the field (675,) beside `path`, which ends in SUFFIX. The format has no metadata."""
    for file, part in zip(_files(path), split(weights), strict=True):
        with atomic_path(file) as temporary:
            np.save(temporary, part)


def read_npy(path):
    """Return the field (675,) of the set of `path`, which ends in SUFFIX.

    Raises NeumatError for a missing or damaged member, and where `parts.join` does.
    """
    return join(path, {file.name: _load(file) for file in _files(path)})


def _files(path):
    """Return the paths of all members of the set of `path`."""
    return [path.with_name(f"{path.name.removesuffix(SUFFIX)}_{member}.npy") for member in MEMBERS]


def _load(file):
    """Return the array of an .npy file, which np.load alone would also take for an archive of several."""
    with reading(file, "an .npy file"), file.open("rb") as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)
