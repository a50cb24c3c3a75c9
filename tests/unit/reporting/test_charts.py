import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from neumat.errors import NeumatError
from neumat.reporting.charts import frontier_chart, pareto
from neumat.reporting.figures import heat_map, nearest_figure
from neumat.reporting.sheets import contact_sheet


def test_pareto_by_hand():
    cost = [1, 2, 3, 4, 2, np.nan, 5]
    loss = [5, 3, 4, 1, 3, 0, np.inf]
    assert pareto(cost, loss).tolist() == [0, 1, 3]


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=12))
def test_every_setting_is_on_the_frontier_or_beaten_by_it(settings):
    cost, loss = np.array(settings).T
    frontier = pareto(cost, loss)
    assert (np.diff(cost[frontier]) > 0).all() and (np.diff(loss[frontier]) < 0).all()
    for c, value in settings:
        assert ((cost[frontier] <= c) & (loss[frontier] <= value)).any()


@pytest.mark.parametrize("goal", ["min", "max", 50])
def test_chart_names_the_default_and_the_frontier(tmp_path, goal):
    table = pd.DataFrame({"s": [0.1, 1, 10], "y": [80, 70, 52], "name": ["a-run", "b-run", "c-run"], "g": [1, 1, 2]})
    stem = tmp_path / "chart"
    frontier_chart(table, "s", "y", "name", "b-run", stem, goal=goal, group="g")
    assert Image.open(f"{stem}.png").size[0] > 500
    text = (tmp_path / "chart.svg").read_text()
    assert "b-run (default)" in text
    assert ("c-run" in text) == (goal != "max") and "a-run" in text
    frontier_chart(table, "s", "y", "name", "b-run", tmp_path / "again", goal=goal, group="g")
    assert (tmp_path / "again.svg").read_text() == text


def test_unknown_default_is_refused(tmp_path):
    with pytest.raises(NeumatError, match="default"):
        frontier_chart(pd.DataFrame({"s": [1], "y": [1], "name": ["a"]}), "s", "y", "name", "b", tmp_path / "chart")
    assert not list(tmp_path.iterdir())


def test_contact_sheet_places_row_by_row():
    images = np.arange(5, dtype=np.uint8)[:, None, None, None] * np.ones((1, 2, 3, 3), np.uint8)
    sheet = contact_sheet(images, columns=2, gap=1)
    assert sheet.shape == (3 * 2 + 2, 2 * 3 + 1, 3)
    assert sheet[0, 0, 0] == 0 and sheet[0, 4, 0] == 1 and sheet[3, 0, 0] == 2 and sheet[6, 2, 0] == 4
    assert (sheet[2] == 255).all() and (sheet[6:, 4:] == 255).all()
    assert contact_sheet(images, columns=5, gap=0).shape == (2, 15, 3)


def test_figures_are_written(tmp_path):
    images = np.zeros((7, 16, 16, 3), np.uint8)
    nearest_figure(images, images, tmp_path / "nearest.png", columns=3)
    matrix = np.random.default_rng(0).random((5, 7))
    matrix[0, 0], matrix[1, 1], matrix[:, 2] = 0, np.inf, np.nan
    heat_map(matrix, tmp_path / "heat.png")
    assert {p.name for p in tmp_path.iterdir()} == {"nearest.png", "heat.png"}
