"""Stores of BTFs: what is written comes back, in bounded memory, and bad ones end in one line."""

import weakref

import h5py
import numpy as np
import pytest
import torch

from neumat.btf.directions import random_pairs
from neumat.btf.store import BtfStore, attributes, read_btf, write_btf
from neumat.errors import NeumatError

S, P, H, W = 3, 4, 6, 8
ABOUT = {"size_mm": 20.0, "tileable": True, "surface": {"name": "bricks", "seed": 1}, "source": "test", "samples": 4}


@pytest.fixture
def arrays():
    generator = torch.Generator().manual_seed(0)
    light, view = (a.view(S, P, 3) for a in random_pairs(S * P, generator))
    return light, view, torch.rand(S, H, W, 3, generator=generator).half().float()


@pytest.fixture
def path(tmp_path, arrays):
    light, view, values = arrays
    write_btf(tmp_path / "a.h5", light, view, H, W, values, **ABOUT)
    return tmp_path / "a.h5"


def test_what_is_written_is_read(path, arrays):
    light, view, values = arrays
    store = read_btf(path)
    assert torch.equal(store.light, light) and torch.equal(store.view, view)
    assert (store.sweeps, store.pairs, store.height, store.width) == (S, P, H, W)
    assert torch.equal(store.values([2, 0, 2]).float(), values[[2, 0, 2]])
    assert attributes(store) == ABOUT | {"kind": "queries", "cosine": True, "extent": 1.0, "partial": False}


def test_store_in_memory_is_like_one_in_a_file(path, arrays):
    light, view, values = arrays
    store, read = BtfStore.from_arrays(values, light, view, **ABOUT), read_btf(path)
    assert attributes(store) == attributes(read)
    assert torch.equal(store.values(torch.tensor([1])), read.values(torch.tensor([1])))


@pytest.mark.parametrize("rows", [1, 4, 6, 7, 18])
def test_blocks_of_any_height_give_the_same_file(tmp_path, arrays, rows):
    light, view, values = arrays
    blocks = values.view(-1, W, 3).split(rows)
    write_btf(tmp_path / "b.h5", light, view, H, W, (block for block in blocks))
    assert torch.equal(read_btf(tmp_path / "b.h5").values(range(S)).float(), values)


def test_parts_in_any_order_give_the_same_file(tmp_path, arrays):
    light, view, values = arrays
    parts = [(k, i, j, values[k : k + 2, i : i + 3, j : j + 5]) for j in (5, 0) for k in (0, 2) for i in (3, 0)]
    write_btf(tmp_path / "b.h5", light, view, H, W, parts)
    assert torch.equal(read_btf(tmp_path / "b.h5").values(range(S)).float(), values)


@pytest.mark.parametrize(("place", "message"), [((1, 0, 0), "within"), ((0, 0, 4), "within"), ((0, 0, 0), "144")])
def test_parts_beyond_the_store_and_missing_ones_are_refused(tmp_path, arrays, place, message):
    light, view, values = arrays
    with pytest.raises(NeumatError, match=message):
        write_btf(tmp_path / "b.h5", light, view, H, W, [(*place, values[:, :, :6])])


def test_blocks_are_let_go_once_written(tmp_path, arrays):
    light, view, values = arrays
    made = []

    def blocks():
        for sweep in values:
            assert all(block() is None for block in made[:-1])  # the writer's loop still names the last
            block = sweep.clone()
            made.append(weakref.ref(block))
            yield block
            del block

    write_btf(tmp_path / "b.h5", light, view, H, W, blocks())
    assert read_btf(tmp_path / "b.h5").sweeps == S


def test_brightest_values_are_cut_to_half_floats_range(tmp_path, arrays):
    light, view, values = arrays
    values[0, 0, 0] = 1e6
    write_btf(tmp_path / "b.h5", light, view, H, W, values)
    assert read_btf(tmp_path / "b.h5").values([0])[0, 0, 0, 0] == torch.finfo(torch.float16).max


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: a.update(values=a["values"][:2]), "144 values"),
        (lambda a: a.update(values=[*a["values"], a["values"][0]]), "144 values"),
        (lambda a: a.update(values=a["values"][:, :, :7]), "shape"),
        (lambda a: a["values"].mul_(-1), "finite values of at least 0"),
        (lambda a: a["values"].fill_(float("nan")), "finite values of at least 0"),
        (lambda a: a["light"].mul_(2), "unit vectors in light"),
        (lambda a: a["view"].fill_(float("nan")), "unit vectors in view"),
        (lambda a: a.update(light=a["light"][:, :3]), "one shape"),
        (lambda a: a.update(kind="pictures"), "one pair"),
        (lambda a: a.update(kind="movies"), "kind"),
        (lambda a: a.update(size_mm=0.0), "size_mm"),
        (lambda a: a.update(light=a["light"].repeat(1, 5, 1), view=a["view"].repeat(1, 5, 1)), "divide"),
    ],
)
def test_bad_data_is_refused_and_nothing_is_left(tmp_path, arrays, change, message):
    data = dict(zip(("light", "view", "values"), arrays, strict=True))
    change(data)
    blocks = data.pop("values")
    with pytest.raises(NeumatError, match=message):
        write_btf(tmp_path / "b.h5", height=H, width=W, blocks=blocks, **data)
    assert not list(tmp_path.iterdir())


def cut(path):
    path.write_bytes(path.read_bytes()[:3000])


def text(path):
    path.write_text("not HDF5")


def altered(change):
    def alter(path):
        with h5py.File(path, "r+") as file:
            change(file)

    return alter


@pytest.mark.parametrize(
    "damage",
    [
        cut,
        text,
        lambda path: path.unlink(),
        altered(lambda file: file.attrs.update(schema_version=9)),
        altered(lambda file: file.attrs.update(units="cd")),
        altered(lambda file: file.attrs.update(surface="{")),
        altered(lambda file: file.attrs.update(samples="many")),
        altered(lambda file: file.attrs.__delitem__("kind")),
        altered(lambda file: file.__delitem__("view")),
        altered(lambda file: file["light"].write_direct(np.zeros((S, P, 3), np.float32))),
    ],
)
def test_damaged_and_foreign_files_end_in_one_line(path, damage):
    damage(path)
    with pytest.raises(NeumatError) as caught:
        read_btf(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_values_that_are_not_finite_are_refused_when_read(path):
    with h5py.File(path, "r+") as file:
        file["values"][1, 0, 0, 0] = np.nan
    store = read_btf(path)
    store.values([0, 2])
    with pytest.raises(NeumatError, match="finite"):
        store.values([1])


def test_sweep_that_is_not_there_is_refused(path):
    with pytest.raises(NeumatError):
        read_btf(path).values([S])
