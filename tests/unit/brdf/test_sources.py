import hashlib
import shutil

import h5py
import numpy as np
import pytest

from neumat.brdf.coordinates import ENTRIES, GRID, above_horizon
from neumat.brdf.merl import write_merl
from neumat.brdf.sources import SOURCES, gram, read_sources, write_sources
from neumat.errors import NeumatError
from neumat.seeds import numpy_generator


def tables():
    """Two tables with different valid entries: the first third of one, the last third of the other are not."""
    values = numpy_generator(0, "sources").gamma(1.0, 1.0, (2, ENTRIES, 3)).astype(np.float32)
    values[0, : ENTRIES // 3] = np.nan
    values[1, -ENTRIES // 3 :] = np.nan
    return values


def register(monkeypatch, values, names=None):
    names = names or [f"m{i}" for i in range(len(values))]
    monkeypatch.setitem(SOURCES, "fake", lambda config: (names, iter(values)))


@pytest.fixture
def store(tmp_path, monkeypatch):
    values = tables()
    register(monkeypatch, values)
    path = tmp_path / "sources.h5"
    write_sources({"kind": "fake"}, path)
    return path, values


def test_keeps_the_entries_that_are_valid_in_every_source(store):
    path, values = store
    sources = read_sources(path)
    assert sources.names == ["m0", "m1"] and sources.n == 2
    valid = ~np.isnan(values).any(axis=(0, 2)) & above_horizon().numpy()
    np.testing.assert_array_equal(sources.entries, np.flatnonzero(valid))
    assert sources.entries.dtype == np.int32
    for i in range(2):
        table = sources.table(i)
        assert table.dtype == np.float32
        np.testing.assert_allclose(table, values[i, sources.entries], rtol=5e-4, atol=1e-7)
    block = sources.column_block(1000, 1010)
    assert block.shape == (6, 10) and block.dtype == np.float16
    np.testing.assert_array_equal(block[4], sources.table(1)[1000:1010, 1])
    positions = np.array([7, 3, 7])
    np.testing.assert_array_equal(sources.values(1, positions), sources.table(1)[positions])


def test_gram(store):
    path, _ = store
    sources = read_sources(path)
    columns = sources.column_block(0, len(sources.entries)).astype(np.float64)
    np.testing.assert_allclose(gram(sources), columns @ columns.T, rtol=1e-12)
    coarse = columns[:, np.all(np.array(np.unravel_index(sources.entries, GRID)) % 2 == 0, axis=0)]
    np.testing.assert_allclose(gram(sources, 2), coarse @ coarse.T, rtol=1e-12)


def test_the_same_input_gives_the_same_digest(store, tmp_path, monkeypatch):
    path, values = store
    register(monkeypatch, values)
    write_sources({"kind": "fake"}, tmp_path / "again.h5")
    values[0, ENTRIES // 2, 0] += 1
    register(monkeypatch, values)
    write_sources({"kind": "fake"}, tmp_path / "other.h5")
    first, again, other = (read_sources(p).digest for p in (path, tmp_path / "again.h5", tmp_path / "other.h5"))
    assert first == again != other


def test_limit_reads_no_more_than_it_keeps(tmp_path, monkeypatch):
    def endless():
        yield np.ones((ENTRIES, 3), np.float32)
        raise AssertionError("read a table beyond the limit")

    register(monkeypatch, endless(), ["first", "second"])
    write_sources({"kind": "fake"}, tmp_path / "sources.h5", limit=1)
    assert read_sources(tmp_path / "sources.h5").names == ["first"]


def test_values_beyond_half_precision_and_sources_without_a_common_entry(tmp_path, monkeypatch):
    path = tmp_path / "sources.h5"
    values = np.ones((2, ENTRIES, 3), np.float32)
    values[1, 5, 2] = 7e4
    register(monkeypatch, values)
    with pytest.raises(NeumatError, match=r"source m1.*65504.*70000"):
        write_sources({"kind": "fake"}, path)
    values[1, 5, 2] = 65520  # the least number that becomes infinite, half a step beyond the largest half
    register(monkeypatch, values)
    with pytest.raises(NeumatError, match=r"source m1.*65504.*65520"):
        write_sources({"kind": "fake"}, path)
    values[1, 5, 2] = 65519
    values[1, -1, 2] = 7e4  # below the horizon: no reflectance
    register(monkeypatch, values)
    write_sources({"kind": "fake"}, path)
    assert read_sources(path).table(1)[5, 2] == 65504
    path.unlink()
    values[1, 5, 2] = 1
    values[0, ::2] = np.nan
    values[1, 1::2] = np.nan
    register(monkeypatch, values)
    with pytest.raises(NeumatError, match="valid in every source"):
        write_sources({"kind": "fake"}, path)
    register(monkeypatch, np.full((1, ENTRIES, 3), np.nan, np.float32))
    with pytest.raises(NeumatError, match="valid in every source"):
        write_sources({"kind": "fake"}, path)
    assert not list(tmp_path.iterdir())


def test_bad_stores(tmp_path, store):
    path, _ = store
    with pytest.raises(NeumatError, match="no such file"):
        read_sources(tmp_path / "absent.h5")
    (tmp_path / "text.h5").write_text("text")
    with pytest.raises(NeumatError, match="foreign file"):
        read_sources(tmp_path / "text.h5")
    h5py.File(tmp_path / "other.h5", "w").close()
    with pytest.raises(NeumatError, match="another kind of store"):
        read_sources(tmp_path / "other.h5")
    shutil.copy(path, tmp_path / "newer.h5")
    with h5py.File(tmp_path / "newer.h5", "a") as file:
        file.attrs["schema_version"] = 99
    with pytest.raises(NeumatError, match=r"newer\.h5.*version 1.*version 99"):
        read_sources(tmp_path / "newer.h5")


@pytest.fixture(scope="module")
def merl_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("merl")
    for name in ("zinc", "ash"):
        write_merl(folder / f"{name}.binary", np.full((ENTRIES, 3), 0.5))
    return folder


def test_a_folder_of_merl_files(merl_folder, tmp_path):
    config = {"kind": "merl", "folder": str(merl_folder), "url": None, "names": None}
    write_sources(config, tmp_path / "sources.h5")
    sources = read_sources(tmp_path / "sources.h5")
    assert sources.names == ["ash", "zinc"] and len(sources.entries) == above_horizon().sum()
    np.testing.assert_allclose(sources.table(1), 0.5, rtol=1e-3)
    names, _ = SOURCES["merl"](config | {"names": ["zinc"]})
    assert names == ["zinc"]


def test_a_url_downloads_what_the_folder_lacks(merl_folder, tmp_path, monkeypatch):
    digest = hashlib.sha256((merl_folder / "ash.binary").read_bytes()).hexdigest()
    checksums = {"ash": (digest, 34_992_012)}
    monkeypatch.setattr("neumat.brdf.sources.merl_checksums", lambda: checksums)
    url = merl_folder.as_uri() + "/{name}.binary"
    names, tables = SOURCES["merl"]({"kind": "merl", "folder": tmp_path, "url": url, "names": None})
    assert names == ["ash"]
    np.testing.assert_allclose(next(tables)[above_horizon()], 0.5, rtol=1e-6)
    assert (tmp_path / "ash.binary").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "exr"}, "sources.kind.*embedded, merl, rgl.*exr"),
        ({"folder": None}, "sources.folder"),
        ({"names": ["vibranium"]}, "sources.names.*vibranium"),
        ({"names": ["ash", "ash"]}, "sources.names.*different"),
        ({"names": []}, "sources.names"),
    ],
)
def test_bad_config(merl_folder, tmp_path, change, words):
    config = {"kind": "merl", "folder": str(merl_folder), "url": None, "names": None} | change
    with pytest.raises(NeumatError, match=words):
        write_sources(config, tmp_path / "sources.h5")
