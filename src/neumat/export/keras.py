"""Keras `.h5` files of weights, laid out as Neural-BRDF publishes them (Keras 2.2.4; Sztrajman et al. 2021)."""

import h5py
import numpy as np

from neumat.errors import NeumatError
from neumat.export.parts import join, split
from neumat.files import atomic_path

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
    """Return the field (675,) of a Keras file of weights, whatever its layers are called.

    Raises NeumatError for a missing, damaged or foreign file, a missing member, and where `parts.join` does.
    """
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise NeumatError(path, "a Keras file of weights (HDF5)", "a damaged or foreign file") from error
    with file:
        if "layer_names" not in file.attrs:
            raise NeumatError(path, "a Keras file of weights (attribute layer_names)", "another kind of HDF5 file")
        try:
            layers = [file[name] for name in file.attrs["layer_names"]]
            return join(path, {name.decode(): g[name][()] for g in layers for name in g.attrs["weight_names"]})
        except KeyError as error:
            raise NeumatError(path, "the layers and weights that its attributes name", "one missing") from error
