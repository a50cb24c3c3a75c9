"""What a scene needs of its materials: the choice keeps what it promises."""

import pytest
import torch

from neumat.fields.layout import SIZE
from neumat.reporting.models_chart import costs
from neumat.scenes.compose import units
from neumat.scenes.model_selection import TRUE, ModelSelection
from neumat.scenes.models import SMALLER
from neumat.seeds import torch_generator

SETTINGS = {
    "width": 48,
    "height": 32,
    "trace": {"width": 24, "samples": 16},
    "verify": {"width": 24, "samples": 32},
    "fit_steps": 300,
    "tolerances": [1e-6, 0.03, 1.0],
}
OBJECT = {"at": [0, 0], "size": 1.0, "turn": 0.0, "masks": [], "bump": None, "normals": None}
OBJECT |= {"repeat": 1.0, "depth": 0.02}
LAYOUT = {
    "light": "studio",
    "exposure": 1.5,
    "camera": {"at": [0.0, 2.0, 6.0], "towards": [0.0, 0.8, 0.0], "fov": 33},
    "objects": {
        "floor": OBJECT | {"shape": "plane", "materials": ["matte"]},
        "ball": OBJECT | {"shape": "sphere", "materials": ["glossy"]},
        "inside": OBJECT | {"shape": "cube", "size": 0.2, "materials": ["matte"]},
    },
}


@pytest.fixture(scope="module")
def needs(field):
    fields = {"matte": field((0.2, 0.1, 0.05), 0.05, 1.0), "glossy": field((0.05, 0.1, 0.2), 50.0, 80.0)}
    # All units at work, or the smallest field could be the material itself.
    noise = 0.05 * torch.randn(SIZE, generator=torch_generator(0, "fields"))
    fields = {name: weights + noise for name, weights in fields.items()}
    return ModelSelection(LAYOUT, {unit: (name, fields[name]) for unit, name in units(LAYOUT).items()}, SETTINGS, 0)


@pytest.fixture(scope="module")
def table(needs):
    return needs.table()


def test_a_material_that_no_path_meets_needs_nothing(needs):
    assert needs.units == [("floor", 0), ("ball", 0)]


def test_the_ladder_ends_with_the_material_itself_which_shows_no_error(needs):
    for unit, models in needs.ladder.items():
        assert [model.rung for model in models][-len(SMALLER) - 1 :] == [*SMALLER, TRUE]
        assert needs.errors[unit][-1] == 0 < min(needs.errors[unit][:-1])


def test_every_object_stays_within_the_tolerance_or_keeps_its_material(table):
    kept = table["rung"] == TRUE
    assert (kept | (table["measured"] <= table["tolerance"])).all()
    assert kept[table["tolerance"] == 1e-6].all() and (table["measured"][table["tolerance"] == 1e-6] == 0).all()
    assert (table["rung"][table["tolerance"] == 1.0] == "lambert").all()


def test_looser_tolerances_cost_no_more(table):
    summary = costs(table.assign(scene="test"))
    assert (summary["bytes"].diff().dropna() <= 0).all()
    assert summary["bytes_share"].iloc[0] == 1 and summary["kept"].tolist()[0] == 2
    assert summary["bytes"].iloc[-1] == 2 * 12
    assert (summary["noise"] > 0).all()


def test_fits_are_better_where_they_were_fitted(needs):
    fits = needs.fits().groupby(["rung", "under"])[["error_scene", "error_angles"]].mean()
    scene, angles = (fits.xs(under, level="under").loc[SMALLER] for under in ("scene", "all angles"))
    assert scene["error_scene"].mean() < angles["error_scene"].mean()
    assert scene["error_angles"].mean() > angles["error_angles"].mean()
