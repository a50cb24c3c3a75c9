"""A user's mistakes end in one line that names the file, what was expected and what was found."""

import h5py
import numpy as np
import pytest
import torch
from safetensors.numpy import load_file, save_file

from neumat.augment.manifest import draw_manifest
from neumat.errors import NeumatError
from neumat.export import EXPORTS, export, find_material, read_material
from neumat.fields.layout import SIZE
from neumat.fields.store import PER_MATERIAL, write_neumerl

WEIGHTS = ["npy", "keras", "safetensors"]
READABLE = [*WEIGHTS, "merl", "rgl"]


def assert_one_line(words, function, *arguments):
    with pytest.raises(NeumatError) as caught:
        function(*arguments)
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def change(path, member, value):
    """Replace one array of an exported field: an index into W1, b1, W2, b2, W3, b3; None removes it."""
    if path.suffix == ".npy":
        file = path.with_name(path.name.replace("fc1", ("fc1", "b1", "fc2", "b2", "fc3", "b3")[member]))
        file.unlink() if value is None else np.save(file, value)
    elif path.suffix == ".h5":
        with h5py.File(path, "r+") as file:
            layer = f"dense_{member // 2 + 1}"
            key = f"{layer}/{layer}/{('kernel:0', 'bias:0')[member % 2]}"
            del file[key]
            if value is not None:
                file[key] = value
    else:
        tensors, key = load_file(path), ("W1", "b1", "W2", "b2", "W3", "b3")[member]
        del tensors[key]
        save_file(tensors if value is None else {**tensors, key: value}, path)


@pytest.mark.parametrize("format", WEIGHTS)
@pytest.mark.parametrize(
    ("member", "value", "words"),
    [
        (0, np.zeros((6, 8), np.float32), ["shape (6, 21)", "(6, 21, 21, 3)", "(6, 8)"]),
        (2, np.zeros((22, 21), np.float32), ["shape (21, 21)", "(22, 21)"]),
        (4, np.zeros((3, 21), np.float32), ["shape (21, 3)", "(3, 21)"]),
        (3, np.full(21, np.nan, np.float32), ["finite values", "NaN"]),
        (5, np.array([1, np.inf, 2], np.float32), ["finite values", "NaN or infinite"]),
        (5, np.zeros(3, np.int64), ["floating-point", "int64"]),
        (1, None, []),
    ],
)
def test_wrong_members(random_field, tmp_path, format, member, value, words):
    path = export(random_field, format, tmp_path, "chrome")
    change(path, member, value)
    assert_one_line(["chrome", *words], read_material, path)


@pytest.mark.parametrize("format", READABLE)
def test_damaged_foreign_and_missing_files(tmp_path, format):
    path = tmp_path / f"chrome{EXPORTS[format][0]}"
    assert_one_line(["chrome", "no such file"], read_material, path)
    assert_one_line(["chrome"], read_material, path.with_name("x" * 5000 + path.name))
    path.write_bytes(b"")
    assert_one_line(["chrome"], read_material, path)
    path.write_bytes(b"a text that someone renamed" * 50)
    assert_one_line(["chrome"], read_material, path)


@pytest.mark.parametrize("format", READABLE)
def test_truncated_files(random_field, tmp_path, format):
    path = export(random_field, format, tmp_path, "chrome")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert_one_line(["chrome"], read_material, path)


def test_other_kinds_of_files(random_field, tmp_path):
    assert_one_line(["chrome.glsl", ".binary, .bsdf"], read_material, export(random_field, "glsl", tmp_path, "chrome"))
    assert_one_line(["one material in the folder", "none"], read_material, tmp_path)
    for name in ("a", "b"):
        export(random_field, "npy", tmp_path, name)
    assert_one_line(["one material", "2 (a_fc1.npy, b_fc1.npy)"], read_material, tmp_path)
    with h5py.File(tmp_path / "store.h5", "w") as file:
        file["weights"] = np.zeros((2, SIZE))
    assert_one_line(["store.h5", "layer_names"], read_material, tmp_path / "store.h5")


def test_what_cannot_be_exported(random_field, tmp_path):
    assert_one_line(["merl, rgl, npy", "'obj'"], export, random_field, "obj", tmp_path, "chrome")
    assert_one_line(["chrome", "(675,)", "(4, 675)"], export, random_field.expand(4, -1), "glsl", tmp_path, "chrome")
    broken = random_field.clone()
    broken[7] = torch.nan
    for format in EXPORTS:
        assert_one_line(["chrome", "finite"], export, broken, format, tmp_path, "chrome")
    for format in ("merl", "rgl"):
        assert_one_line(["chrome", "finite values"], export, torch.full((SIZE,), 9.0), format, tmp_path, "chrome")
    assert not list(tmp_path.iterdir())


@pytest.fixture
def store(tmp_path):
    names = ["alum-bronze", "chrome", "chrome-steel", "nickel", "teflon"]
    manifest = draw_manifest(names, {"blends": 2, "held_out": 0.2, "weight_range": [0.3, 0.7]}, 0)
    weights = torch.arange(len(manifest), dtype=torch.float32)[:, None].expand(-1, SIZE)
    path = tmp_path / "neumerl.h5"
    write_neumerl(path, manifest, weights, {key: np.zeros(len(manifest)) for key in PER_MATERIAL}, {})
    return path


def test_materials_of_the_manifest(store):
    assert find_material(store, "chrome")[0] == 6
    assert find_material(store, "blend-001@rbg")[0] == 37
    assert_one_line(["neumerl.h5", "such as chrome, chrome-steel", "'chrom'"], find_material, store, "chrom")
    assert_one_line(["such as chrome-steel", "'steel'"], find_material, store, "steel")
    assert_one_line(["such as chrome@bgr, "], find_material, store, "chrom@bgr")


@pytest.mark.parametrize("format", EXPORTS)
@pytest.mark.parametrize(
    "name", ["", ".", "..", "../x", "a/b", "a\\b", "a\nb", "a\rvec2 b", "a\x00", "a\u2028b", "\udc80"]
)
def test_names_that_no_file_should_have(random_field, tmp_path, format, name):
    assert_one_line(["a name without slashes"], export, random_field, format, tmp_path / "out", name)
    assert not list(tmp_path.iterdir())


def test_samples(store, tmp_path):
    samples = tmp_path / "samples.h5"
    with h5py.File(samples, "w") as file:
        file["samples"] = np.arange(3, dtype=np.float32)[:, None].repeat(SIZE, 1)
    assert find_material(samples, "sample-2").shape == (SIZE,) and find_material(samples, "sample-2")[0] == 2
    assert_one_line(["sample-0 to sample-2", "'sample-3'"], find_material, samples, "sample-3")
    assert_one_line(["neumerl.h5", "store of samples"], find_material, store, "sample-1")
    assert_one_line(["a store of samples"], find_material, tmp_path / "none.h5", "sample-1")
