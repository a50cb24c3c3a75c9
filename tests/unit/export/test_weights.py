"""The formats of weights: exact round trips, and the layout of the published files."""

import base64
import io
import json
import math
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from neumat.brdf.coordinates import half_difference, rusinkiewicz
from neumat.errors import NeumatError
from neumat.export import EXPORTS, export, find_material, read_material
from neumat.export.keras import architecture, exp_minus_one
from neumat.fields.distill import read_teachers
from neumat.fields.field import log_reflectance

FORMATS = ["npy", "keras", "safetensors"]
PUBLISHED = sorted((Path(__file__).parents[4] / "shared" / "data" / "nbrdf").glob("*_nbrdf.zip"))
published = pytest.mark.skipif(not PUBLISHED, reason="the published NBRDFs are not on this machine")


@pytest.mark.parametrize("format", FORMATS)
def test_round_trip_is_exact(random_field, tmp_path, format):
    path = export(random_field, format, tmp_path / "a", "blend-000@rbg")
    assert path.name == f"blend-000@rbg{EXPORTS[format][0]}"
    for found in (read_material(path), read_material(path.parent)):
        assert found.dtype == torch.float32 and torch.equal(found, random_field)


def test_npy_set_is_laid_out_as_neural_brdf_reads_it(random_field, tmp_path):
    export(random_field, "npy", tmp_path, "chrome")
    shapes = {"fc1": (6, 21), "b1": (21,), "fc2": (21, 21), "b2": (21,), "fc3": (21, 3), "b3": (3,)}
    assert {path.name for path in tmp_path.iterdir()} == {f"chrome_{member}.npy" for member in shapes}
    parts = [np.load(tmp_path / f"chrome_{member}.npy") for member in shapes]
    assert [part.shape for part in parts] == list(shapes.values())
    assert all(part.dtype == np.float32 and part.flags.c_contiguous for part in parts)
    np.testing.assert_array_equal(parts[0].ravel(), random_field[:126].numpy())


def test_safetensors_say_what_they_are(random_field, tmp_path):
    path = export(random_field, "safetensors", tmp_path, "chrome", source="neumerl.h5")
    with safe_open(path, "np") as file:
        metadata = file.metadata()
        assert set(file.keys()) == {"W1", "b1", "W2", "b2", "W3", "b3"}
    assert set(metadata) == {"name", "widths", "layout", "units", "coordinates", "source", "neumat"}
    assert (metadata["name"], metadata["source"]) == ("chrome", "neumerl.h5")


@pytest.mark.parametrize("dtype", [torch.float16, torch.bfloat16, torch.float32, torch.float64])
def test_safetensors_of_every_floating_type(random_field, tmp_path, dtype):
    path = export(random_field, "safetensors", tmp_path, "chrome")
    save_file({name: tensor.to(dtype) for name, tensor in load_file(path).items()}, path)
    expected = random_field.to(dtype).float()
    assert torch.equal(read_material(path), expected) and read_material(path).dtype == torch.float32


@pytest.mark.parametrize("text", [True, False])
@pytest.mark.parametrize("root", ["/", "/model_weights"])
def test_keras_files_of_other_versions(random_field, tmp_path, text, root):
    """Names as text or bytes, weights alone or in a whole saved model."""
    path = export(random_field, "keras", tmp_path, "chrome")
    with h5py.File(path) as source, h5py.File(tmp_path / "other.h5", "w") as target:
        group = target.require_group(root)
        for name in source:
            source.copy(name, group)
        group.attrs["layer_names"] = source.attrs["layer_names"]
        for item in (group, *group.values()):
            for key, value in item.attrs.items():
                if text and len(value):
                    item.attrs[key] = [name.decode() for name in value]
    assert torch.equal(read_material(tmp_path / "other.h5"), random_field)


def test_keras_weights_of_the_same_names_in_every_layer(random_field, tmp_path):
    """As Keras 3 writes a whole model."""
    path = export(random_field, "keras", tmp_path, "chrome")
    with h5py.File(path, "r+") as file:
        for name in ("dense_1", "dense_2", "dense_3"):
            layer = file[name]
            for long, short in zip(layer.attrs["weight_names"], ("kernel", "bias"), strict=True):
                layer.move(long, short)
            layer.attrs["weight_names"] = ["kernel", "bias"]
    assert torch.equal(read_material(path), random_field)


def character_set(attribute):
    """Return whether an attribute is ASCII or UTF-8, which decides whether older programs read it as bytes or text."""
    kind = attribute.get_type()
    return kind.get_cset() if isinstance(kind, h5py.h5t.TypeStringID) else None


def structure(file):
    """Return {member: attributes, type and shape} of an HDF5 file."""

    def describe(item):
        attributes = {
            key: (item.attrs.get_id(key).get_type().get_class(), character_set(item.attrs.get_id(key)), value.tolist())
            for key, value in ((key, np.asarray(value)) for key, value in item.attrs.items())
        }
        return attributes, (item.dtype, item.shape) if isinstance(item, h5py.Dataset) else None

    found = {"": describe(file)}
    file.visititems(lambda name, item: found.update({name: describe(item)}))
    return found


def test_the_architecture_beside_the_keras_file(random_field, pairs, tmp_path):
    """Read as Keras does, layer by layer, it is the field."""
    path = export(random_field, "keras", tmp_path, "chrome")
    model = json.loads(path.with_suffix(".json").read_text())
    *dense, last = model["config"]["layers"]
    x = half_difference(*rusinkiewicz(*pairs)).numpy()
    assert dense[0]["config"]["batch_input_shape"] == [None, x.shape[1]]
    with h5py.File(path) as file:
        for layer, relu in zip(dense, (True, True, False), strict=True):
            group = file[layer["config"]["name"]]
            kernel, bias = (group[name] for name in group.attrs["weight_names"])
            assert layer["class_name"] == "Dense" and kernel.shape == (x.shape[1], layer["config"]["units"])
            x = x @ kernel[()] + bias[()]
            assert layer["config"]["activation"] == ("relu" if relu else "linear")
            x = np.maximum(x, 0) if relu else x
        assert last["config"]["name"] in file and last["class_name"] == "Lambda"
    expected = log_reflectance(random_field, half_difference(*rusinkiewicz(*pairs)))
    np.testing.assert_allclose(x, expected, rtol=1e-4, atol=1e-4)
    assert base64.b64decode(last["config"]["function"][0]) == exp_minus_one()


@pytest.mark.skipif(
    sys.version_info >= (3, 8) and not shutil.which("python3.7"), reason="needs Python 3.7, as Keras 2.2"
)
def test_the_last_layer_in_the_python_of_keras_2():
    code = "import math, marshal, sys, types; code = marshal.loads(bytes.fromhex(sys.argv[1])); "
    code += "print(types.FunctionType(code, {'K': math})(1.5))"
    environment = os.environ | {"PYENV_VERSION": "3.7"}
    done = subprocess.run(["python3.7", "-c", code, exp_minus_one().hex()], capture_output=True, env=environment)
    if done.returncode == 127:
        pytest.skip("python3.7 is a name without a program")
    assert float(done.stdout) == math.exp(1.5) - 1, done.stderr


@published
def test_the_architecture_says_what_the_published_ones_say():
    def agree(ours, theirs):
        """Ours may leave out what Keras fills in or asks for in training only."""
        if isinstance(ours, dict):
            return all(agree(value, theirs[key]) for key, value in ours.items())
        if isinstance(ours, list):
            return len(ours) == len(theirs) and all(map(agree, ours, theirs))
        return ours == theirs

    with zipfile.ZipFile(PUBLISHED[0]) as file:
        theirs = json.loads(file.read(next(name for name in file.namelist() if name.endswith(".json"))))
    ours = architecture()
    compiled, published = (m["config"]["layers"][-1]["config"].pop("function")[0] for m in (ours, theirs))
    assert agree(ours, theirs)
    instructions = exp_minus_one()[26:40]  # behind the header and their number
    assert instructions in base64.b64decode(published) and instructions in base64.b64decode(compiled)


@pytest.mark.parametrize("rows", [1, 3])
def test_the_weights_of_a_request(random_field, tmp_path, rows):
    weights = torch.stack([k + random_field for k in range(rows)])
    np.save(tmp_path / "weights.npy", weights.numpy())
    (tmp_path / "preview.png").touch()
    for k in range(rows):
        assert torch.equal(find_material(str(tmp_path / "weights.npy"), str(k)), weights[k])
    for number in (str(rows), "9" * 5000):  # Python makes no number of so many digits
        with pytest.raises(NeumatError, match=rf"0 to {rows - 1}; found '{number}'"):
            find_material(tmp_path / "weights.npy", number)
    for path in (tmp_path / "weights.npy", tmp_path):
        if rows == 1:
            assert torch.equal(read_material(path), random_field)
        else:
            with pytest.raises(NeumatError, match=r"one material.*0 to 2.*found 3"):
                read_material(path)
    np.save(tmp_path / "weights.npy", random_field.numpy())
    assert torch.equal(read_material(tmp_path), random_field)


@published
def test_published_files_are_read_and_written_alike(tmp_path):
    for archive in PUBLISHED:
        names, weights = read_teachers(archive)
        with zipfile.ZipFile(archive) as file:
            members = {Path(member).stem: member for member in file.namelist() if member.endswith(".h5")}
            for name, expected in list(zip(names, weights, strict=True))[:8]:
                content = file.read(members[name])
                (tmp_path / "theirs.h5").write_bytes(content)
                assert torch.equal(read_material(tmp_path / "theirs.h5"), expected)
                ours = export(expected, "keras", tmp_path, name)
                with h5py.File(io.BytesIO(content)) as a, h5py.File(ours) as b:
                    assert structure(a) == structure(b)
