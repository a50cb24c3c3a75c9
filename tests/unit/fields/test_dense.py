import numpy as np
import pandas as pd
import pytest
import torch

from neumat.augment.dense import PARENTS, dense_indices, dense_values, read_dense
from neumat.augment.manifest import draw_manifest, read_manifest
from neumat.brdf import sources as sources_module
from neumat.brdf.coordinates import ENTRIES, above_horizon
from neumat.brdf.sources import read_sources, write_sources
from neumat.errors import NeumatError
from neumat.fields.dense import fit_dense, thinned
from neumat.fields.dense_stages import fit_dense_shard, gather_dense, write_recipe
from neumat.fields.dense_store import read_dense_fields, write_dense
from neumat.fields.fit import GROUP, Directions, random_weights
from neumat.fields.layout import WIDTHS, permute_channels
from neumat.fields.store import PER_MATERIAL, write_neumerl
from neumat.generative.dataset import training_dataset
from neumat.generative.hyperdiffusion import HyperDiffusion

NAMES = list("abcdefg")
SPARSE = above_horizon().nonzero()[::331, 0].numpy()
RECIPE = {"count": 20, "parents": [1, 4, 2], "logarithmic": 0.5, "brightness": 1.5, "mixing": 1.0}
FIT = {"highlight_share": 0.5, "schedule": "cosine", "precision": "float32"}
FIT |= {"dense": {"bases_per_job": 8, "samples": 4000, "batch_size": 256, "learning_rate": 0.01}}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A folder with sources, their fields and the recipe of a dense set."""
    folder = tmp_path_factory.mktemp("dense")
    generator = np.random.default_rng(0)
    tables = []
    for _ in NAMES:
        table = np.full((ENTRIES, 3), np.nan, np.float32)
        table[SPARSE] = generator.uniform(0.05, 0.2, 3)
        tables.append(table)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sources_module.SOURCES, "synthetic", lambda config: (NAMES, iter(tables)))
        write_sources({"kind": "synthetic"}, folder / "sources.h5")
    manifest = draw_manifest(NAMES, {"blends": 3, "weight_range": [0.3, 0.7], "held_out": 0.3}, 0)
    manifest.to_csv(folder / "manifest.tsv", sep="\t", index=False)
    fields = torch.stack([0.3 * random_weights(WIDTHS, 0, f"field {base}") for base in manifest["base"]])
    fields[:, -3:] = 0.2
    fits = {key: np.ones(len(manifest)) for key in PER_MATERIAL}
    write_neumerl(folder / "neumerl.h5", manifest, fields, fits, {})
    write_recipe(folder / "manifest.tsv", folder / "neumerl.h5", RECIPE, 0, folder / "dense.tsv")
    return folder


def fitted(run, size, name):
    files = run / "dense.tsv", run / "sources.h5", run / "neumerl.h5"
    shards = []
    for start in range(0, 20, size):
        shards.append(run / f"{name}-{start}.h5")
        fit_dense_shard(*files, list(range(20))[start : start + size], FIT, 0, shards[-1])
    gather_dense(shards[::-1], run / "dense.tsv", run / f"{name}.h5")
    return read_dense_fields(run / f"{name}.h5")


@pytest.fixture(scope="module")
def store(run):
    return fitted(run, 20, "whole")


def test_fits_are_the_same_for_any_number_of_shards(run, store):
    parts = fitted(run, 7, "parts")
    assert torch.equal(parts.weights, store.weights)
    assert all(np.array_equal(parts.fits[key], store.fits[key]) for key in PER_MATERIAL)


def test_the_store_holds_the_recipe(run, store):
    pd.testing.assert_frame_equal(store.rows, read_dense(run / "dense.tsv"), check_dtype=False)
    assert store.fits["loss_grid"].mean() < 0.05 and not store.fits["retried"].any()


def test_values_are_those_of_the_sources(run, store):
    sources, positions = read_sources(run / "sources.h5"), np.array([3, 0, 11])
    alone = store.rows[(store.rows["weight_a"] == 1)]
    found = dense_values(sources, alone, positions)
    for values, row in zip(found, alone.to_dict("records"), strict=True):
        parent = sources.values(NAMES.index(row["parent_a"]), positions)
        mixing = np.array([[row[f"mix_{a}{b}"] for b in "rgb"] for a in "rgb"])
        np.testing.assert_allclose(values, row["brightness"] * parent @ mixing.T, rtol=1e-5)
    assert dense_values(sources, store.rows, positions).shape == (20, 3, 3)


@pytest.mark.parametrize("protocol", ["parity", "grouped", "fold0"])
def test_a_model_is_trained_on_unrelated_bases_in_all_orders(run, store, protocol):
    files = run / "neumerl.h5", run / "manifest.tsv", run / "sources.h5", protocol, 10, HyperDiffusion
    good = np.arange(20) % 5 > 0
    write_dense(run / "some.h5", store.rows, store.weights, store.fits | {"converged": good}, {})
    plain, dense = training_dataset(*files), training_dataset(*files, run / "some.h5")
    manifest, count = read_manifest(run / "manifest.tsv"), len(plain.weights)
    train = dense_indices(store.rows, manifest, protocol)
    train = train[good[train]]
    assert torch.equal(dense.weights[:count], plain.weights) and len(dense.weights) == count + 6 * len(train)
    added = dense.base[count:] - len(manifest) // 6
    assert set(added) == set(train) and not dense.is_source[count:].any()
    k = count + int(np.flatnonzero((added == train[1]) & (dense.permutation[count:] == 3))[0])
    assert torch.equal(dense.weights[k], permute_channels(store.weights[train[1]], "gbr"))
    if protocol == "grouped":
        held = set(manifest["parent_a"][manifest["grouped"] == "test"])
        assert not held & set(store.rows[PARENTS].to_numpy()[added].ravel())


def test_a_thinned_grid_keeps_the_two_sides_apart():
    directions = Directions(torch.from_numpy(SPARSE), 0)
    part, positions = thinned(directions, 500)
    assert abs(len(positions) - 500) <= 2 and len(positions.unique()) == len(positions)
    assert torch.equal(part.rows, directions.rows[positions])
    for side in ("held", "train"):
        ours, theirs = positions[getattr(part, side)], getattr(directions, side)
        assert torch.isin(ours, theirs).all() and len(ours) / len(theirs) == pytest.approx(500 / len(SPARSE), rel=0.05)
    assert len(thinned(directions, 10**9)[1]) == len(SPARSE)


def test_a_fit_that_diverges_stays_as_it_started():
    directions = Directions(torch.from_numpy(SPARSE), 0)
    values = torch.full((len(SPARSE), 2, 3), 0.1)
    start = torch.stack([random_weights(WIDTHS, 0, "a"), random_weights(WIDTHS, 0, "b")])
    start[1] *= 1e12
    found = fit_dense(values, directions, start, FIT, 0)
    assert found["converged"].tolist()[1] is False and torch.equal(found["weights"][1], start[1])
    assert found["loss_grid"][0] < 0.05
    with pytest.raises(NeumatError, match=f"at most {GROUP} materials"):
        fit_dense(torch.zeros(1, GROUP + 1, 3), directions, start, FIT, 0)


def test_a_missing_shard_is_no_store(run, store):
    fit_dense_shard(run / "dense.tsv", run / "sources.h5", run / "neumerl.h5", [0, 1], FIT, 0, run / "few.h5")
    with pytest.raises(NeumatError, match="fits of all 20 dense bases, once each; found 2 fits"):
        gather_dense([run / "few.h5"], run / "dense.tsv", run / "none.h5")
    assert not (run / "none.h5").exists()
