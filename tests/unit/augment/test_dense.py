import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from neumat.augment.dense import (
    COLUMNS,
    LARGEST_ALBEDO,
    MIXING,
    PARENTS,
    RECIPE,
    WEIGHTS,
    dense_indices,
    draw_dense,
    draw_recipe,
    mix,
    parents_of,
    read_dense,
)
from neumat.augment.manifest import draw_manifest, held_out_sources, source_rows
from neumat.errors import NeumatError

NAMES = [f"m{i}" for i in range(30)]
CONFIG = {"count": 400, "parents": [1, 4, 2], "logarithmic": 0.5, "brightness": 1.5, "mixing": 1.0}
AUGMENT = {"blends": 8, "weight_range": [0.3, 0.7], "held_out": 0.1}
ALBEDO = np.linspace(0.05, 0.9, len(NAMES))


@pytest.fixture(scope="module")
def manifest():
    return draw_manifest(NAMES, AUGMENT, 0)


@pytest.fixture(scope="module")
def rows(manifest):
    return draw_dense(manifest, ALBEDO, CONFIG, 0)


def recipe(**changes):
    """One base as the sources leave it, but for the changes."""
    plain = dict(zip(MIXING, np.eye(3).ravel(), strict=True)) | dict.fromkeys(PARENTS, "a")
    row = plain | {"base": "dense-00000", "weight_a": 1.0, "weight_b": 0.0, "weight_c": 0.0}
    return pd.DataFrame([row | {"logarithmic": 0, "brightness": 1.0} | changes])[RECIPE]


def test_counts_sides_and_numbers(rows, manifest):
    assert list(rows.columns) == COLUMNS and len(rows) == 400 and rows["base"].is_unique
    assert (rows["grouped"] == "test").sum() == 40  # the share of the sources
    kinds = (rows[WEIGHTS] > 0).sum(axis=1).value_counts(normalize=True)
    assert abs(kinds[1] - 1 / 7) < 0.06 and abs(kinds[2] - 4 / 7) < 0.08
    assert rows["brightness"].between(1 / 1.5, 1.5).all() and rows["logarithmic"].isin([0, 1]).all()
    assert draw_dense(manifest, ALBEDO, CONFIG, 0).equals(rows)
    assert not draw_dense(manifest, ALBEDO, CONFIG, 1).equals(rows)
    assert draw_dense(manifest, ALBEDO, CONFIG | {"count": 0}, 0).empty


def test_no_base_has_parents_on_two_sides(rows, manifest):
    side = source_rows(manifest).set_index("base")["grouped"]
    for parent in PARENTS:
        assert (rows[parent].map(side) == rows["grouped"]).all()


@pytest.mark.parametrize("protocol", ["grouped", "fold0", "fold4"])
def test_training_has_no_relative_of_what_is_held_out(rows, manifest, protocol):
    held = held_out_sources(manifest, protocol)
    train = dense_indices(rows, manifest, protocol)
    related = [bool(held & set(parents)) for parents in rows[PARENTS].to_numpy()]
    assert list(train) == [k for k, relative in enumerate(related) if not relative] and 0 < len(train) < len(rows)


def test_parity_trains_on_all_and_other_protocols_are_named(rows, manifest):
    assert len(dense_indices(rows, manifest, "parity")) == len(rows)
    with pytest.raises(NeumatError, match="fold9"):
        dense_indices(rows, manifest, "fold9")


def test_a_base_depends_on_its_number_alone():
    whole = draw_recipe(NAMES, ALBEDO, range(20), CONFIG, 3)
    parts = [draw_recipe(NAMES, ALBEDO, part, CONFIG, 3) for part in (range(0, 7), range(7, 20))]
    pd.testing.assert_frame_equal(whole, pd.concat(parts, ignore_index=True))


@given(seed=st.integers(0, 10**6), scale=st.floats(1e-3, 1e3))
def test_energy_is_kept(seed, scale):
    """A base reflects no more than allowed wherever its parents do not: at each entry, f stands for the albedo."""
    drawn = draw_recipe(NAMES, ALBEDO, range(6), CONFIG | {"brightness": 20.0}, seed)
    mixing = drawn[MIXING].to_numpy().reshape(-1, 3, 3)
    assert (mixing >= 0).all() and np.allclose(mixing.sum(2), 1) and np.allclose(drawn[WEIGHTS].sum(axis=1), 1)
    share = np.random.default_rng(seed).uniform(0, 1, (len(NAMES), 50, 3))
    values = (scale * ALBEDO[:, None, None] * share).astype(np.float32)
    numbers, where = parents_of(drawn, NAMES, "here")
    assert mix(values[numbers], where, drawn).max() <= 1.0001 * scale * LARGEST_ALBEDO


def test_closed_forms():
    generator = np.random.default_rng(0)
    values = generator.lognormal(size=(3, 40, 3)).astype(np.float32)
    where = np.array([[0, 1, 2]])
    for logarithmic in (0, 1):
        alone = mix(values, where, recipe(logarithmic=logarithmic))
        np.testing.assert_allclose(alone[0], values[0], rtol=1e-5)  # weight 1 gives the parent
        shares = {"weight_a": 0.3, "weight_b": 0.5, "weight_c": 0.2, "logarithmic": logarithmic}
        equal = mix(values[[0, 0, 0]], where, recipe(**shares))
        np.testing.assert_allclose(equal[0], values[0], rtol=1e-5)  # a blend of equals is itself
    halves = {"weight_a": 0.5, "weight_b": 0.5}
    np.testing.assert_allclose(mix(values, where, recipe(**halves))[0], values[:2].mean(0), rtol=1e-5)
    geometric = np.sqrt((1 + values[0]) * (1 + values[1])) - 1
    np.testing.assert_allclose(mix(values, where, recipe(**halves, logarithmic=1))[0], geometric, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(mix(values, where, recipe(brightness=1.5))[0], 1.5 * values[0], rtol=1e-5)
    grey = mix(values, where, recipe(**dict.fromkeys(MIXING, 1 / 3)))
    np.testing.assert_allclose(grey[0], values[0].mean(1, keepdims=True).repeat(3, 1), rtol=1e-5)
    green = recipe(**dict(zip(MIXING, [0, 1, 0, 1, 0, 0, 0, 0, 1], strict=True)))  # the first row makes red
    np.testing.assert_array_equal(mix(values, where, green)[0], values[0][:, [1, 0, 2]])


def test_a_table_comes_back_and_others_are_refused(rows, tmp_path):
    rows.to_csv(tmp_path / "dense.tsv", sep="\t", index=False)
    pd.testing.assert_frame_equal(read_dense(tmp_path / "dense.tsv"), rows)
    rows.drop(columns="brightness").to_csv(tmp_path / "short.tsv", sep="\t", index=False)
    with pytest.raises(NeumatError, match="the columns base, parent_a"):
        read_dense(tmp_path / "short.tsv")
    rows.assign(weight_b=np.nan).to_csv(tmp_path / "odd.tsv", sep="\t", index=False)
    with pytest.raises(NeumatError, match="finite numbers"):
        read_dense(tmp_path / "odd.tsv")


def test_mistakes_are_named(rows):
    with pytest.raises(NeumatError, match=r"as many as bases have parents, \[0, 0, 1\]; found 2"):
        draw_recipe(NAMES[:2], ALBEDO[:2], range(1), CONFIG | {"parents": [0, 0, 1]}, 0)
    with pytest.raises(NeumatError, match="30 positive numbers"):
        draw_recipe(NAMES, ALBEDO[:5], range(1), CONFIG, 0)
    with pytest.raises(NeumatError, match=r"the parents of the dense set; found no m7"):
        parents_of(recipe(parent_b="m7"), ["a"], "a store")
