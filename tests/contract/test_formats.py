"""Every file that is read, changed in every way that a test can think of: a valid result or one line, never else."""

import itertools
import json
import os
import shutil
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
import torch
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.torch import save_file

from neumat.augment.build import build
from neumat.augment.manifest import protocol_indices, read_manifest
from neumat.augment.store import AugMerl
from neumat.brdf import sources as sources_module
from neumat.brdf.coordinates import ENTRIES, above_horizon
from neumat.brdf.merl import read_merl, write_merl
from neumat.brdf.rgl import Rgl, read_tensors
from neumat.brdf.sources import read_sources, write_sources
from neumat.brdf.types import read_types, type_rows
from neumat.conditions.prompts import read_prompts
from neumat.conditions.store import Conditions, read_conditions, write_conditions
from neumat.config import load, load_scene
from neumat.errors import NeumatError
from neumat.export import export, find_material, read_material
from neumat.export.rgl import write_tensors
from neumat.fields.layout import SIZE
from neumat.fields.stages import fit_gather
from neumat.fields.store import PER_MATERIAL, read_neumerl, read_samples, write_neumerl
from neumat.generative.base import Dataset
from neumat.generative.constrained import Found, write_found
from neumat.generative.registry import METHODS
from neumat.seeds import numpy_generator, torch_generator
from neumat.studies.constrained import read_found

ROOT = Path(__file__).parents[2]
SCHEMAS = ROOT / "workflow" / "schemas"
NAMES = list("abcdef")
CONFIG = {"blends": 4, "components": 6, "weight_range": [0.3, 0.7], "held_out": 0.2}
FITS = dict.fromkeys(PER_MATERIAL, 0.5)
FAMILIES = set(read_types(ROOT / "config" / "types.tsv")["family"])


def make_files(folder):
    """Write a good file of every format."""
    generator, weights = numpy_generator(0, "formats"), 0.1 * torch.randn(SIZE, generator=torch_generator(0, "formats"))
    for format in ("npy", "keras", "safetensors"):
        export(weights, format, folder, "field")
    np.save(folder / "weights.npy", weights.repeat(2, 1).numpy())
    tensors = {
        "phi_i": np.zeros(1),
        "theta_i": np.linspace(0, 1.5, 3),
        "ndf": np.ones((2, 3)),
        "sigma": np.ones((2, 2)),
    }
    tensors |= {"vndf": np.ones((1, 3, 2, 2)), "luminance": np.ones((1, 3, 2, 2)), "rgb": np.ones((1, 3, 3, 2, 2))}
    bytes_ = {"description": np.zeros(4, np.uint8), "jacobian": np.ones(1, np.uint8)}
    write_tensors(folder / "field.bsdf", {key: value.astype(np.float32) for key, value in tensors.items()} | bytes_)
    tables = np.full((len(NAMES), ENTRIES, 3), np.nan, np.float32)
    kept = above_horizon().nonzero()[::500, 0].numpy()
    tables[:, kept] = generator.uniform(0.1, 2, (len(NAMES), len(kept), 3))
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sources_module.SOURCES, "synthetic", lambda config: (NAMES, iter(tables)))
        write_sources({"kind": "synthetic"}, folder / "sources.h5")
    build(folder / "sources.h5", CONFIG, 0, folder / "augmerl.h5", folder / "manifest.tsv", folder / "report.csv")
    manifest = read_manifest(folder / "manifest.tsv")
    n = len(manifest)
    many = weights.repeat(n, 1)
    write_neumerl(folder / "neumerl.h5", manifest, many, {key: np.full(n, v) for key, v in FITS.items()}, {})
    with h5py.File(folder / "shard.h5", "w") as file:
        file["index"], file["weights"] = np.arange(0, n, 6), many[::6].numpy()
        for key in PER_MATERIAL:
            file[key] = np.full(n // 6, 0.5 if key.startswith("loss") else True)
        file.attrs["config"] = json.dumps({"independent": False})
    write_found(folder / "found.h5", "diffuse", "rejection", Found(many[:3].numpy(), 4, 3, 0), 3, 1.0, 0)
    facts = pd.DataFrame({key: ["x"] * n for key in ("name", "thing", "family", "colour", "gloss")})
    noise = torch.rand(n, 2, 5)
    said = Conditions("toy", ["t"], torch.ones(n, 1), facts, [["a", "b"]] * n, noise, noise)
    write_conditions(folder / "conditions.h5", said)
    dataset = Dataset(many + torch.randn(n, SIZE), np.arange(n) // 6, np.arange(n) % 6, np.ones(n, bool))
    METHODS["copies"].from_config({}).fit(dataset, 0).save(folder / "model.safetensors")
    for table in ("types", "prompts"):
        shutil.copy(ROOT / "config" / f"{table}.tsv", folder)
    shutil.copy(ROOT / "config" / "config.yaml", folder)
    shutil.copy(sorted((ROOT / "config" / "scenes").glob("*.yaml"))[0], folder / "scene.yaml")
    table = np.where(above_horizon().numpy()[:, None], 0.1, np.nan) * np.ones((1, 3))
    write_merl(folder / "field.binary", table)


def read_stores(path):
    """Open an AugMERL store, or the source store that lies beside it, and read of both."""
    other = {"augmerl.h5": "sources.h5", "sources.h5": "augmerl.h5"}
    store = AugMerl(path.parent / "augmerl.h5", path.parent / "sources.h5") if path.name in other else None
    store.table(0), store.table(6 * len(NAMES)), read_sources(path.parent / "sources.h5").column_block(0, 8)


def read_shard(path):
    fit_gather([path], path.parent / "manifest.tsv", path.parent / "gathered.h5")


def read_model(path):
    assert np.isfinite(METHODS["copies"].load(path).sample(2, 0)).all()


def read_manifested(path):
    rows = read_manifest(path)
    protocol_indices(rows, "parity"), protocol_indices(rows, "fold0")


def read_typed(path):
    types = read_types(path)
    type_rows(pd.DataFrame({"parent_a": ["chrome"], "parent_b": ["steel"]}), types)


def read_config(path):
    config = yaml.safe_load(path.read_text(encoding="utf-8"))
    load(config, SCHEMAS / "config.schema.json")


# {file: reader}; beside it a copy of `beside` is left as it is.
READERS = {
    "field_fc1.npy": read_material,
    "weights.npy": lambda path: find_material(path, 1),
    "field.h5": read_material,
    "field.safetensors": read_material,
    "field.bsdf": lambda path: Rgl(path).reflected(*torch.tensor([[[0.6, 0.0, 0.8]], [[-0.6, 0.0, 0.8]]])),
    "sources.h5": read_stores,
    "augmerl.h5": read_stores,
    "neumerl.h5": read_neumerl,
    "shard.h5": read_shard,
    "found.h5": lambda path: (read_found(path), read_samples(path), find_material(path, "sample-0")),
    "conditions.h5": read_conditions,
    "model.safetensors": read_model,
    "manifest.tsv": read_manifested,
    "types.tsv": read_typed,
    "prompts.tsv": lambda path: read_prompts(path, FAMILIES),
    "scene.yaml": lambda path: load_scene(path, SCHEMAS / "scene.schema.json"),
}
BESIDE = {"sources.h5": ["augmerl.h5"], "augmerl.h5": ["sources.h5"], "shard.h5": ["manifest.tsv"]}
BESIDE["field_fc1.npy"] = [f"field_{member}.npy" for member in ("b1", "fc2", "b2", "fc3", "b3")]
counter = itertools.count()


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    folder = tmp_path_factory.mktemp("good")
    make_files(folder)
    return folder


def copy_of(good, name):
    """Return a fresh copy of a good file, in a folder of its own with what lies beside it."""
    folder = good.parent / "changed" / str(next(counter))
    folder.mkdir(parents=True)
    for file in (name, *BESIDE.get(name, [])):
        shutil.copy(good / file, folder)
    return folder / name


def judge(path, read, change):
    """Read a changed file: it is numbers, or a line that says why not."""
    try:
        found = read(path)
        assert not torch.is_tensor(found) or torch.isfinite(found).all(), change
    except NeumatError as error:
        assert "\n" not in str(error), change
    finally:
        shutil.rmtree(path.parent)


slow = settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])


@pytest.mark.parametrize("name", READERS)
def test_good_files_are_read(good, name):
    READERS[name](copy_of(good, name))


@pytest.mark.parametrize("name", READERS)
def test_missing_files_folders_and_texts(good, name):
    for content in (None, "folder", b"", b"text", b"\xff\xfe\x00" * 100):
        path = copy_of(good, name)
        path.unlink()
        if content == "folder":
            path.mkdir()
        elif content is not None:
            path.write_bytes(content)
        with pytest.raises(NeumatError) as caught:
            READERS[name](path)
        assert "\n" not in str(caught.value)
        assert content is not None or "no such file" in str(caught.value)
        assert content != "folder" or "damaged" not in str(caught.value)


@slow
@given(data=st.data())
@pytest.mark.parametrize("name", READERS)
def test_truncated_files_and_flipped_bytes(good, name, data):
    path = copy_of(good, name)
    size = path.stat().st_size
    flips = data.draw(st.lists(st.tuples(st.integers(0, min(size, 4096) - 1), st.integers(1, 255)), max_size=8))
    content = bytearray(path.read_bytes())
    for at, bits in flips:
        content[at] ^= bits
    length = data.draw(st.one_of(st.just(size), st.integers(0, size)))
    path.write_bytes(content[:length])
    judge(path, READERS[name], (flips, length))


ARRAYS = st.sampled_from(
    [
        None,
        "group",
        np.float64(1),
        np.zeros(0),
        np.zeros((2, 3)),
        np.full((7, SIZE), np.nan),
        np.arange(5),
        np.array([b"x", b"y"]),
        np.array([b"\xff\xfe"]),
        h5py.Empty("f8"),
        np.zeros((1, 2, 3, 4), np.complex64),
    ]
)
VALUES = st.sampled_from(
    [None, 3, -1, 2.5, "text", b"\xff", np.zeros(3), h5py.Empty("f8"), "{", "[1]", np.array([b"x"])]
)


def variant_of(array, data):
    """Return an array of another type, shape or content."""
    change = data.draw(st.sampled_from(["type", "longer", "shorter", "deeper", "NaN", "negative", "large", "bytes"]))
    if change == "type":
        kind = data.draw(st.sampled_from(["f2", "f4", "f8", ">f4", "i4", "u1", "?", "c8"]))
        return np.zeros(array.shape, kind) if array.dtype.kind in "OSV" else array.astype(kind)
    if change in ("longer", "deeper", "shorter"):
        return {"longer": np.concatenate([array, array]) if array.ndim else array, "deeper": array[None]}.get(
            change, array[:-1] if array.ndim else array
        )
    if array.dtype.kind in "OSVb" or change == "bytes":
        return np.zeros(array.shape, "S3")
    filler = {"NaN": np.nan, "negative": -1e6, "large": 1e6}[change]
    with np.errstate(all="ignore"):
        return np.full(array.shape, filler).astype(array.dtype)


@slow
@given(data=st.data())
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", [name for name in READERS if name.endswith(".h5")])
def test_stores_of_another_structure(good, name, data):
    path = copy_of(good, name)
    with h5py.File(path, "r+") as file:
        members = []
        file.visit(members.append)
        member = data.draw(st.sampled_from(["/", *members]))
        if data.draw(st.booleans()) and len(file[member].attrs):
            key, value = data.draw(st.sampled_from(sorted(file[member].attrs))), data.draw(VALUES)
            del file[member].attrs[key]
            if value is not None:
                file[member].attrs[key] = value
            change = (member, key, value)
        elif member != "/":
            new = data.draw(ARRAYS)
            if isinstance(file[member], h5py.Dataset) and data.draw(st.booleans()):
                new = variant_of(file[member][()], data)
            del file[member]
            if isinstance(new, str):
                file.create_group(member)
            elif new is not None:
                file[member] = new
            change = (member, new)
        else:
            change = None
    judge(path, READERS[name], change)


@slow
@given(data=st.data())
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", [name for name in READERS if not name.endswith((".h5", ".tsv", ".yaml"))])
def test_arrays_of_another_kind(good, name, data):
    path = copy_of(good, name)
    if name.endswith(".npy"):
        array = variant_of(np.load(path), data)
        np.save(path, data.draw(st.sampled_from([array, np.array({"a": 1}, object), np.float32(1)])), allow_pickle=True)
    elif name.endswith(".bsdf"):
        tensors = read_tensors(path)
        key = data.draw(st.sampled_from(sorted(tensors)))
        tensors[key] = np.ascontiguousarray(variant_of(tensors[key], data))
        if tensors[key].dtype.str not in ("<f2", "<f4", "<f8", "<i4", "|u1") or data.draw(st.booleans()):
            del tensors[key]
        write_tensors(path, tensors)
    else:
        with safe_open(path, "pt") as file:
            tensors, metadata = {key: file.get_tensor(key) for key in file.keys()}, file.metadata()
        key = data.draw(st.sampled_from(sorted(tensors)))
        kinds = [torch.bfloat16, torch.float16, torch.float64, torch.int32, torch.bool]
        tensor = tensors.pop(key)
        changes = [
            None,
            tensor[:-1].clone() if tensor.ndim else tensor,
            tensor[None],
            tensor * torch.nan,
            tensor * 1e30,
        ]
        changed = data.draw(st.sampled_from([*changes, *map(tensor.to, kinds)]))
        if changed is not None:
            tensors[key] = changed
        save_file(tensors, path, data.draw(st.sampled_from([metadata, None])))
    judge(path, READERS[name], name)


TEXTS = st.sampled_from(["", "x", "-1", "nan", "1e400", "\t", '"', "a b", "0", "test", "rgb", "金", "\r", "\x00"])


@slow
@given(data=st.data())
@pytest.mark.parametrize("name", [name for name in READERS if name.endswith(".tsv")])
def test_tables_with_other_cells(good, name, data):
    path = copy_of(good, name)
    rows = [line.split("\t") for line in path.read_text(encoding="utf-8").splitlines()]
    i = data.draw(st.sampled_from([0, 0, *range(min(len(rows), 8))]))
    j = data.draw(st.integers(0, len(rows[i]) - 1))
    change = data.draw(st.sampled_from(["cell", "column", "missing cell", "no rows"]))
    if change == "cell":
        rows[i][j] = data.draw(TEXTS)
    elif change == "column":
        rows = [row[:j] + row[j + 1 :] for row in rows]
    elif change == "missing cell":
        del rows[i][j]
    else:
        rows = rows[:1]
    path.write_text("\n".join(map("\t".join, rows)) + "\n", encoding="utf-8", newline="")
    judge(path, READERS[name], (i, j, change))


def nodes(value, path=()):
    """Yield the path of every value in nested dicts and lists."""
    yield path
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from nodes(inner, (*path, key))


@slow
@given(data=st.data())
@pytest.mark.parametrize("name", ["config.yaml", "scene.yaml"])
def test_settings_of_other_types(good, name, data):
    path = copy_of(good, name)
    tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    at = data.draw(st.sampled_from(list(nodes(tree))))
    others = [None, 0, -1, 1e999, True, "x", "", [], {}, [1, "a"], {"x": 1}, {1: 2}, float("nan"), [[]]]
    new = data.draw(st.sampled_from(others))
    if at:
        inner = tree
        for key in at[:-1]:
            inner = inner[key]
        inner[at[-1]] = new
    else:
        tree = new
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    judge(path, READERS.get(name, read_config), (at, new))


@settings(parent=slow, max_examples=6)
@given(data=st.data())
def test_tables_of_merl(good, data):
    path = copy_of(good, "field.binary")
    size = path.stat().st_size
    with path.open("r+b") as file:
        for at, value in data.draw(st.lists(st.tuples(st.integers(0, 60), st.integers(0, 255)), max_size=4)):
            file.seek(at)
            file.write(bytes([value]))
    os.truncate(path, data.draw(st.sampled_from([size, size, size - 1, size // 2, size + 8, 12, 11, 0])))
    judge(path, read_merl, None)
