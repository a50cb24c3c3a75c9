"""The formats of weights: exact round trips, and the layout of the published files."""

import io
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from neumat.export import EXPORTS, export, read_material
from neumat.fields.distill import read_teachers

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


def structure(file):
    """Return {member: attributes, type and shape} of an HDF5 file."""

    def describe(item):
        attributes = {key: (np.asarray(value).dtype, np.asarray(value).tolist()) for key, value in item.attrs.items()}
        return attributes, (item.dtype, item.shape) if isinstance(item, h5py.Dataset) else None

    found = {"": describe(file)}
    file.visititems(lambda name, item: found.update({name: describe(item)}))
    return found


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
