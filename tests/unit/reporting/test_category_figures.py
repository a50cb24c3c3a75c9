import numpy as np
import pandas as pd
import pytest
from PIL import Image

from neumat.reporting.category_figures import (
    constrained_chart,
    constrained_sheet,
    statistics_by_material,
    statistics_by_type,
)
from neumat.reporting.kmeans_figure import kmeans_figure


@pytest.fixture
def table():
    generator = np.random.default_rng(0)
    table = pd.DataFrame(
        generator.lognormal(0, 2, (9, 6)), columns=[f"{q}_{c}" for q in ("mean", "maximum") for c in "rgb"]
    )
    return table.assign(
        name=[f"material-{i}" for i in range(9)],
        type=["felt"] * 3 + ["steel"] * 4 + ["unknown"] * 2,
        family=["fabric"] * 3 + ["metal"] * 4 + ["unknown"] * 2,
        maximum=table[["maximum_r", "maximum_g", "maximum_b"]].max(axis=1),
    )


@pytest.mark.parametrize("draw", [statistics_by_type, statistics_by_material, kmeans_figure])
def test_statistics_are_drawn(table, draw, tmp_path):
    draw(table, tmp_path / "x.png")
    assert min(Image.open(tmp_path / "x.png").size) > 150


def test_one_family_is_drawn(table, tmp_path):
    statistics_by_material(table[table["family"] == "metal"], tmp_path / "x.png")
    assert (tmp_path / "x.png").is_file()


def test_chart_takes_any_ways_and_searches_without_success(tmp_path):
    table = pd.DataFrame(
        {
            "category": ["diffuse", "plastic", "diffuse", "plastic"],
            "way": ["rejection", "rejection", "guided", "guided"],
            "accepted": [3, 0, 5, 6],
            "seconds": [9.0, 80.0, 2.0, 3.0],
            "seconds_per_accepted": [3.0, np.inf, 0.4, 0.5],
            "training_share": [0.1, 0.02, 0.1, 0.02],
        }
    )
    constrained_chart(table, tmp_path / "x.png")
    assert Image.open(tmp_path / "x.png").size[0] > 500


@pytest.mark.parametrize("image", [None, np.full((64, 192, 3), 90, np.uint8)])
def test_sheet_says_how_the_search_ended(image, tmp_path):
    constrained_sheet(image, "plastic: 0 of 4 materials found", tmp_path / "x.png")
    picture = np.asarray(Image.open(tmp_path / "x.png").convert("L"))
    assert (picture[:60] < 100).any()  # the line
    assert ((picture == 90).mean() > 0.3) == (image is not None)


def test_sheets_of_many_pictures_are_no_larger_than_these(tmp_path):
    """The report has a sheet of each category and may take 20 MB in all."""
    constrained_sheet(np.full((256, 768, 3), 90, np.uint8), "plastic", tmp_path / "x.png")
    assert Image.open(tmp_path / "x.png").size[0] == pytest.approx(768, abs=2)
