"""Keras `.h5` files of weights, laid out as Neural-BRDF publishes them (Keras 2.2.4; Sztrajman et al. 2021)."""

import h5py
import numpy as np

from neumat.errors import NeumatError
from neumat.export.parts import check_shapes, join, split
from neumat.files import atomic_path, reading

LAYERS = ("dense_1", "dense_2", "dense_3")
OUTPUT = "lambda_1"  # exp(x) - 1: a layer without weights


def write_keras(path, weights, metadata):
    """Write the field (675,) as a Keras file of weights. The format has no metadata."""
    parts = split(weights)
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update(backend="tensorflow", keras_version="2.2.4")
        file.attrs["layer_names"] = np.array([*LAYERS, OUTPUT], "S")
        for layer, kernel, bias in zip(LAYERS, parts[::2], parts[1::2], strict=True):
            group = file.create_group(layer)
            group.attrs["weight_names"] = np.array([f"{layer}/kernel:0", f"{layer}/bias:0"], "S")
            group[f"{layer}/kernel:0"], group[f"{layer}/bias:0"] = kernel, bias
        file.create_group(OUTPUT).attrs["weight_names"] = np.array([])


def read_keras(path):
    """Return the field (675,) of a Keras file of weights or of a whole model, whatever its layers are called.

    Raises NeumatError for a missing, damaged or foreign file, a missing member, and where `parts.join` does.
    """
    what = "a Keras file of weights (HDF5)"
    with reading(path, what), h5py.File(path, "r") as file:
        root = file.get("model_weights", file)  # where a whole saved model has its weights
        if "layer_names" not in root.attrs:
            found = "weights of Keras 3 (save them with Keras 2)" if "layers" in file else "another kind of HDF5 file"
            raise NeumatError(path, f"{what}, with the attribute layer_names", found)
        parts = {}
        for layer in _names(path, root, "layer_names"):
            group = _member(path, root, layer, h5py.Group)
            for name in _names(path, group, "weight_names"):
                parts[name] = _member(path, group, name, h5py.Dataset)
        check_shapes(path, parts)  # before they are read: a foreign dataset may be of any size
        return join(path, {name: part[()] for name, part in parts.items()})


def _names(path, group, attribute):
    """Return the list of str in an attribute, which some programs write as bytes and others as text."""
    value = group.attrs.get(attribute)
    if np.ndim(value) != 1 or not all(isinstance(name, str | bytes) for name in value):
        raise NeumatError(path, f"a list of names in the attribute {attribute} of {group.name}", repr(value))
    return [name.decode() if isinstance(name, bytes) else name for name in value]


def _member(path, group, name, kind):
    """Return the member of a group that an attribute names."""
    found = group.get(name)
    if not isinstance(found, kind):
        raise NeumatError(path, "the layers and weights that its attributes name", f"no {name}")
    return found
