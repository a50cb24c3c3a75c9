import h5py
import numpy as np
import pandas as pd
import pytest

from neumat.augment.build import build
from neumat.augment.manifest import read_manifest
from neumat.augment.store import AugMerl
from neumat.brdf import sources as sources_module
from neumat.brdf.coordinates import ENTRIES, above_horizon
from neumat.brdf.merl import SCALE
from neumat.brdf.sources import write_sources
from neumat.errors import NeumatError

SPARSE = above_horizon().nonzero()[::74, 0].numpy()
CONFIG = {"blends": 6, "components": 300, "weight_range": [0.3, 0.7], "held_out": 0.2}


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    folder = tmp_path_factory.mktemp("store")
    generator = np.random.default_rng(3)
    tables = []
    for _ in range(5):
        table = np.full((ENTRIES, 3), np.nan, np.float32)
        table[SPARSE] = generator.lognormal(size=(len(table[SPARSE]), 3))
        tables.append(table)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sources_module.SOURCES, "synthetic", lambda config: (list("abcde"), iter(tables)))
        write_sources({"kind": "synthetic"}, folder / "sources.h5")
    build(folder / "sources.h5", CONFIG, 0, folder / "augmerl.h5", folder / "manifest.tsv", folder / "report.csv")
    return folder, tables


def open_store(folder):
    return AugMerl(folder / "augmerl.h5", folder / "sources.h5")


def test_sources_stay_as_measured(store):
    folder, tables = store
    expected = tables[2][SPARSE].astype(np.float16)
    np.testing.assert_array_equal(open_store(folder).table(2 * 6), expected)


def test_blends_mix_their_parents(store):
    folder, tables = store
    manifest = read_manifest(folder / "manifest.tsv")
    row = manifest.iloc[5 * 6]
    a, b = ("abcde".index(row[key]) for key in ("parent_a", "parent_b"))
    expected = row["weight"] * tables[a][SPARSE] + (1 - row["weight"]) * tables[b][SPARSE]
    np.testing.assert_allclose(open_store(folder).table(5 * 6), expected, rtol=2e-3)


def test_permutations_and_subsets_are_those_of_the_table(store):
    folder, _ = store
    opened = open_store(folder)
    gbr = opened.table(7 * 6 + 3)
    np.testing.assert_array_equal(gbr, opened.table(7 * 6)[:, [1, 2, 0]])
    positions = np.array([5, 3, 999])
    for index in (2 * 6 + 4, 7 * 6 + 3):  # a source and a blend
        np.testing.assert_array_equal(opened.values(index, positions), opened.table(index)[positions])


def test_materialised_table_reads_back(store, tmp_path):
    folder, _ = store
    opened = open_store(folder)
    opened.materialise(31, tmp_path / "m.binary")
    raw = np.fromfile(tmp_path / "m.binary", "<f8", offset=12).reshape(3, ENTRIES).T
    np.testing.assert_allclose((raw * SCALE)[opened.entries], opened.table(31), rtol=1e-6)
    assert (raw == -1).all(1).sum() == ENTRIES - len(opened.entries)


def test_report_says_what_projection_costs(store):
    report = pd.read_csv(store[0] / "report.csv").set_index("quantity")["value"]
    assert report["materials"] == 66
    assert report["variance_kept"] == pytest.approx(1)
    assert report["projection_mean_log_change"] < 1e-3
    assert {"table_ms", "subset_ms"} < set(report.index)


def test_foreign_stores_are_refused(store, tmp_path):
    folder, _ = store
    with pytest.raises(NeumatError, match="no such file"):
        AugMerl(tmp_path / "absent.h5", folder / "sources.h5")
    other = tmp_path / "other.h5"
    with h5py.File(folder / "augmerl.h5") as source, h5py.File(other, "w") as target:
        for key in source:
            source.copy(key, target)
        target.attrs.update(dict(source.attrs), schema_version=99)
    with pytest.raises(NeumatError, match="version 99"):
        AugMerl(other, folder / "sources.h5")
    with h5py.File(other, "a") as target:
        target.attrs.update(schema_version=1, sources="else")
    with pytest.raises(NeumatError, match="was made from"):
        AugMerl(other, folder / "sources.h5")
