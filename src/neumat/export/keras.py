"""Keras `.h5` files of weights, laid out as Neural-BRDF publishes them (Keras 2.2.4; Sztrajman et al. 2021).

Beside each lies the `.json` of the model's architecture, from which its tools make the model before they load weights.
"""

import base64
import json
import struct

import h5py
import numpy as np

from neumat.errors import NeumatError
from neumat.export.parts import check_shapes, join, split
from neumat.fields.layout import WIDTHS
from neumat.files import atomic_path, reading

LAYERS = ("dense_1", "dense_2", "dense_3")
OUTPUT = "lambda_1"  # exp(x) - 1: a layer without weights


def write_keras(path, weights, metadata):
    """Write the field (675,) as a Keras file of weights, and its architecture beside it. The format has no metadata."""
    parts = split(weights)
    with atomic_path(path.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(architecture()), encoding="utf-8")
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        for key, value in (("backend", "tensorflow"), ("keras_version", "2.2.4")):
            # Keras 2.2 decodes them, so they must come back from its h5py as bytes: as ASCII, not as UTF-8.
            file.attrs.create(key, value, dtype=h5py.string_dtype("ascii"))
        file.attrs["layer_names"] = np.array([*LAYERS, OUTPUT], "S")
        for layer, kernel, bias in zip(LAYERS, parts[::2], parts[1::2], strict=True):
            group = file.create_group(layer)
            group.attrs["weight_names"] = np.array([f"{layer}/kernel:0", f"{layer}/bias:0"], "S")
            group[f"{layer}/kernel:0"], group[f"{layer}/bias:0"] = kernel, bias
        file.create_group(OUTPUT).attrs["weight_names"] = np.array([])


def architecture():
    """Return the model's architecture, as Keras 2 writes and reads it: three dense layers, then exp(x) - 1."""
    layers = []
    for name, width, activation in zip(LAYERS, WIDTHS[1:], ("relu", "relu", "linear"), strict=True):
        layers.append({"class_name": "Dense", "config": {"name": name, "units": width, "activation": activation}})
    layers[0]["config"] |= {"batch_input_shape": [None, WIDTHS[0]], "dtype": "float32"}
    code = base64.b64encode(exp_minus_one()).decode()
    config = {"name": OUTPUT, "function": [code, None, None], "function_type": "lambda", "output_shape": None}
    config |= {"output_shape_type": "raw", "arguments": {}}
    layers.append({"class_name": "Lambda", "config": config})
    model = {"name": "sequential_1", "layers": layers}
    return {"class_name": "Sequential", "config": model, "keras_version": "2.2.4", "backend": "tensorflow"}


def exp_minus_one():
    """Return `lambda x: K.exp(x) - 1` as a Lambda layer stores it: compiled, by `marshal`, for Python 3.7.

    The published files hold the same; Keras 2.2.4 runs on no Python that compiles otherwise and is newer.
    """

    def texts(*names):
        return struct.pack("<cB", b")", len(names)) + b"".join(b"Z" + bytes([len(n)]) + n.encode() for n in names)

    # LOAD_GLOBAL K; LOAD_METHOD exp; LOAD_FAST x; CALL_METHOD; LOAD_CONST 1; BINARY_SUBTRACT; RETURN_VALUE.
    code = bytes([0x74, 0, 0xA0, 1, 0x7C, 0, 0xA1, 1, 0x64, 1, 0x18, 0, 0x53, 0])
    # Arguments, keyword-only ones, local variables, depth of the stack, flags: optimised, new locals, no free names.
    header = struct.pack("<c5i", b"c", 1, 0, 1, 3, 0x43)
    constants = b")\x02N" + struct.pack("<ci", b"i", 1)
    names = texts("K", "exp") + texts("x") + texts() + texts()
    origin = texts("neumat", "<lambda>")[2:] + struct.pack("<i", 1)
    return (
        header + struct.pack("<ci", b"s", len(code)) + code + constants + names + origin + struct.pack("<ci", b"s", 0)
    )


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
                # With the layer's name: Keras 3 calls them kernel and bias in every layer.
                parts[f"{layer}/{name}"] = _member(path, group, name, h5py.Dataset)
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
