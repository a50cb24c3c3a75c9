"""Fits of measured materials: which choose, which report, and how good the fields are."""

from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
import torch

from neumat.brdf.analytic import Glossy
from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles
from neumat.brdf.merl import write_merl
from neumat.config import fit_files
from neumat.errors import NeumatError
from neumat.export import export
from neumat.fields.fit import random_weights
from neumat.fields.layout import SIZE, WIDTHS
from neumat.studies.fit_quality import fit_summary
from neumat.studies.fit_sweep import measured_rows
from neumat.studies.measured_fits import NONE, REPORTING, VALIDATION, fit_measured, sets

RGL = Path(__file__).parents[4] / "shared/data/rgl"
CONFIG = {"samples": 20_000, "batch_size": 128, "highlight_share": 0.5, "learning_rate": 0.02, "schedule": "cosine"}
CONFIG |= {"precision": "float32", "polish": {"samples": 0}}


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    path = tmp_path_factory.mktemp("first") / "first.h5"
    with h5py.File(path, "w") as file:
        file["weights"] = random_weights(WIDTHS, 0, "test").numpy()
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three materials, a field beside the last, and what is neither."""
    folder = tmp_path_factory.mktemp("measured")
    valid = above_horizon().nonzero()[:, 0]
    for name, alpha in (("001", 0.5), ("b", 0.3), ("c", 0.4)):
        values = np.full((ENTRIES, 3), np.nan)
        values[valid] = Glossy((0.3, 0.2, 0.1), (0.04,) * 3, alpha).eval(*grid_angles(valid))
        write_merl(folder / f"{name}.binary", values)
    export(torch.zeros(SIZE), "keras", folder, "c")
    (folder / "README.txt").write_text("not a material")
    return folder


@pytest.fixture(scope="module")
def table(folder, first):
    return fit_measured(fit_files({"measured": str(folder)}), first, CONFIG, 32, 0)


def test_two_thirds_choose_and_the_rest_report():
    assert sets(["c", "a", "b"]) == {"a": VALIDATION, "b": VALIDATION, "c": REPORTING}
    for count in range(2, 12):
        split = list(sets([f"{k:02}" for k in range(count)]).values())
        assert split == sorted(split, reverse=True)  # the first choose
        assert split.count(REPORTING) >= 1 and split.count(VALIDATION) == 2 * count // 3 >= 1


def test_every_measured_material_has_a_row_under_its_own_name(table):
    assert table["name"].tolist() == ["001", "b", "c"]
    assert table["set"].tolist() == [VALIDATION, VALIDATION, REPORTING]
    assert (table["loss_grid"] < table["loss_constant"]).all() and (table["psnr"] > 25).all()


def test_a_published_field_is_judged_on_the_same_material(table):
    """A field of zeros is black: it loses mean log(1 + f cos), far more than a fit."""
    published = table.set_index("name")["loss_published"]
    assert published[["001", "b"]].isna().all()
    assert published["c"] > 2 * table.set_index("name")["loss_grid"]["c"]


def test_results_do_not_depend_on_the_order_of_the_files(folder, first, table):
    files = fit_files({"measured": str(folder)})
    pd.testing.assert_frame_equal(fit_measured(files[::-1], first, CONFIG, 32, 0), table)


def test_the_summary_tells_the_sets_apart(table):
    fitted = table.assign(set="fitted", name=[f"s{k}" for k in range(3)], loss_published=np.nan, psnr=[50, 60, 70])
    summary = fit_summary(pd.concat([fitted, table])).set_index(["set", "quantity"])
    assert summary.loc[("fitted", "psnr"), "mean"] == 60 and summary.loc[("fitted", "psnr"), "worst_material"] == "s0"
    assert summary.loc[(REPORTING, "psnr"), "mean"] == table["psnr"].iloc[-1]
    assert summary.loc[(VALIDATION, "loss_grid"), "mean"] == table["loss_grid"].iloc[:2].mean()
    assert (REPORTING, "loss_published") in summary.index and ("fitted", "loss_published") not in summary.index


def test_without_a_folder_every_table_says_so(table, first):
    none = fit_measured([], first, CONFIG, 32, 0)
    assert none["name"].tolist() == [NONE]
    fitted = table.assign(set="fitted").drop(columns="loss_published")  # of a run without published fields
    summary = fit_summary(pd.concat([fitted, none]))
    assert summary.iloc[-1][["set", "quantity"]].tolist() == ["measured", NONE] and np.isnan(summary.iloc[-1]["mean"])
    assert measured_rows([], [], None, CONFIG, 32, 0) == [{"family": NONE, "label": NONE}]


def test_the_chart_has_every_budget_on_validation_and_the_default_on_the_rest(folder):
    labels = ["0.02 M, cosine", *(f"{share * 0.02:.3g} M samples" for share in (0.25, 0.5, 2, 4))]
    rows = [{"family": "default" if k == 0 else "samples", "label": x, "seconds": k} for k, x in enumerate(labels)]
    start = random_weights(WIDTHS, 0, "test")
    found = measured_rows(rows, fit_files({"measured": str(folder)}), start, CONFIG, 32, 0)
    families = [row["family"] for row in found]
    assert families.count(VALIDATION) == 5 and families.count(REPORTING) == 1
    assert [row["seconds"] for row in found] == [0, 0, 1, 2, 3, 4]
    losses = {row["label"]: row["loss_grid"] for row in found}
    assert losses[f"{labels[-1]}: {VALIDATION}"] < losses[f"{labels[1]}: {VALIDATION}"]


@pytest.mark.parametrize("names", [None, [], ["a.bsdf"], ["a.bsdf", "a.binary"], ["a.bsdf", "sample-1.bsdf"], ["a.h5"]])
def test_a_folder_that_cannot_be_split_is_refused_before_anything_runs(names, tmp_path):
    if names is not None:
        for name in names:
            (tmp_path / name).touch()
    with pytest.raises(NeumatError) as caught:
        fit_files({"measured": str(tmp_path if names is not None else tmp_path / "none")})
    assert "\n" not in str(caught.value)


def test_the_case_of_an_ending_does_not_matter(tmp_path):
    names = ["a.BSDF", "b.binary"]
    for name in names:
        (tmp_path / name).touch()
    assert [path.name for path in fit_files({"measured": str(tmp_path)})] == names


def test_nothing_is_named_without_a_folder():
    assert fit_files({"measured": None}) == []


@pytest.mark.skipif(not RGL.is_dir(), reason="no measured materials in ../shared/data/rgl")
def test_real_measurements_are_fitted(first):
    """Two choose and one reports; real noise leaves more than the smooth tables above."""
    found = fit_measured(fit_files({"measured": str(RGL)}), first, CONFIG, 32, 0)
    assert found["set"].tolist() == [VALIDATION, VALIDATION, REPORTING] and found["psnr"].between(15, 70).all()
