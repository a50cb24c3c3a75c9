"""The model that comes with the package, for requests where none is named.

It has learnt every source, so nothing is left to measure it on: no table and no judge may load it.
"""

import copy
from importlib.resources import files
from pathlib import Path

import torch

from neumat.errors import NeumatError

LARGEST = 12_000_000  # bytes


def packaged_model():
    """Return the path of the packaged model. Raises NeumatError in an installation without it."""
    path = Path(str(files("neumat").joinpath("data/model.safetensors")))
    if not path.is_file():
        raise NeumatError(path, "the model of the package (`make packaged`), or another that is named", "no such file")
    return path


def halved(model):
    """Return a ConditionalDiffusion with the weights of `model`: matrices in float16, vectors in float32.

    Those are few, and the means among them are too large to lose digits. A saved one is float32 again when loaded.
    """
    result, result.base = copy.copy(model), copy.copy(model.base)
    result.base.state, result.state, result.extra = map(_halves, (model.base.state, model.state, model.extra))
    return result


def write_packaged(path, model):
    """Write the halved model. Raises NeumatError where the file is larger than the package has room for."""
    halved(model).save(path)
    size = Path(path).stat().st_size
    if size > LARGEST:
        Path(path).unlink()
        raise NeumatError(path, f"a model of at most {LARGEST / 1e6:g} MB", f"{size / 1e6:.2f} MB")


def _halves(tensors):
    return {
        name: value.to(torch.float16 if value.ndim > 1 else torch.float32) if value.is_floating_point() else value
        for name, value in tensors.items()
    }
