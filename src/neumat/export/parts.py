"""The six arrays that make up a field, as the formats of weights have them: named, checked, joined."""

from itertools import pairwise

import numpy as np
import torch

from neumat.errors import NeumatError
from neumat.fields.layout import WIDTHS, unpack

SHAPES = [shape for a, b in pairwise(WIDTHS) for shape in ((a, b), (b,))]


def split(weights):
    """Return [W1, b1, W2, b2, W3, b3], float32 arrays of SHAPES, of a field (675,); kernels are (in, out)."""
    return [np.ascontiguousarray(part) for layer in unpack(weights) for part in layer]


def check_shapes(path, parts):
    """Raise NeumatError where the arrays or datasets {member of the file: W1, b1, W2, b2, W3, b3} are not those of a
    field: another number of them, other shapes (so other widths), other than floating-point numbers."""
    if len(parts) != len(SHAPES):
        raise NeumatError(path, f"{len(SHAPES)} arrays, kernels and biases of widths {WIDTHS}", f"{len(parts)} arrays")
    for (member, part), shape in zip(parts.items(), SHAPES, strict=True):
        if part.shape != shape:
            raise NeumatError(path, f"{member} of shape {shape} (a field of widths {WIDTHS})", f"shape {part.shape}")
        if not np.issubdtype(part.dtype, np.floating):
            raise NeumatError(path, f"floating-point numbers in {member}", part.dtype)


def join(path, parts):
    """Return the field (675,), float32, of the arrays {member of the file: W1, b1, W2, b2, W3, b3}.

    Raises NeumatError where `check_shapes` does, and for values that are not finite in single precision.
    """
    check_shapes(path, parts)
    with np.errstate(over="ignore"):
        parts = {member: part.astype(np.float32) for member, part in parts.items()}
    for member, part in parts.items():
        if not np.isfinite(part).all():
            raise NeumatError(path, f"finite values in {member}", "NaN or infinite ones")
    return torch.from_numpy(np.concatenate([part.ravel() for part in parts.values()]))
