import numpy as np
import pandas as pd
import pytest

from neumat.reporting.coverage import coverage_chart, coverage_table


def rows(values):
    """Rows of two folds: values {(method, level): (coverage of each held-out source of a fold, precision)}."""
    found = []
    for (method, level), (covered, precision) in values.items():
        for fold, shift in (("fold3", 0.0), ("fold4", 0.02)):
            key = (fold, method, level)
            found += [(*key, "coverage", 10, i, value + shift) for i, value in enumerate(covered)]
            found += [(*key, "precision", 5, 0, precision), (*key, "valid", 5, 0, 1.0)]
    for fold in ("fold3", "fold4"):
        found += [(fold, "held-out", 0, "precision", 5, 0, 0.05), (fold, "held-out", 0, "novelty", 5, 0, 0.06)]
    return pd.DataFrame(found, columns=["protocol", "method", "level", "measure", "size", "item", "value"])


VALUES = {
    ("hyperdiffusion", 0): ([0.04, 0.05], 0.06),
    ("copies", 0): ([0.06, 0.07], 0.0),
    ("blends", 0.5): ([0.05, 0.07], 0.05),
    ("blends", 1.0): ([0.01, 0.02], 0.09),
}


def test_means_over_folds_stand_beside_copies_and_the_best_null_that_is_as_precise():
    table = coverage_table(rows(VALUES), 200, 0).set_index(["method", "level"])
    model = table.loc["hyperdiffusion", 0]
    assert model["coverage"] == pytest.approx(0.055)
    assert model["of_copies"] == pytest.approx(0.055 / 0.075)
    assert model["null"] == "blends 0.5" and model["frontier"] == pytest.approx(0.07)
    assert model["behind"] == pytest.approx(-0.015)
    assert model["behind_low"] == pytest.approx(-0.02) and model["behind_high"] == pytest.approx(-0.01)
    assert table.loc[("blends", 1.0), "null"] == "blends 0.5"  # no null is measured by the model
    assert np.isnan(table.loc[("copies", 0), "behind"])
    assert table.loc["held-out"]["precision"].item() == 0.05 and (table["folds"] == "fold3, fold4").all()


def test_an_interval_holds_the_mean_and_is_the_same_for_the_same_sources():
    table = coverage_table(rows(VALUES), 500, 0).set_index(["method", "level"])
    shown = table[table["coverage"].notna()]
    assert ((shown["low"] < shown["coverage"]) & (shown["coverage"] < shown["high"])).all()
    assert coverage_table(rows(VALUES), 500, 0).equals(coverage_table(rows(VALUES), 500, 0))


def test_the_chart_is_written(tmp_path):
    coverage_chart(coverage_table(rows(VALUES), 20, 0), tmp_path / "coverage")
    assert (tmp_path / "coverage.png").stat().st_size and (tmp_path / "coverage.svg").stat().st_size
