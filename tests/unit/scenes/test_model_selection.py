"""What a scene needs of its materials: the choice keeps what it promises."""

import pytest
import torch

import neumat.scenes.model_selection as module
from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles
from neumat.brdf.table import Table
from neumat.fields.field import Field
from neumat.fields.layout import SIZE
from neumat.reporting.models_chart import costs
from neumat.scenes.compose import units
from neumat.scenes.model_selection import ModelSelection
from neumat.scenes.models import SMALLER, WIDEST
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


def tabulated(weights, scale=1.0):
    """Return the Table of a field, `scale` times as bright."""
    valid = above_horizon().nonzero()[:, 0]
    values = torch.full((ENTRIES, 3), torch.nan)
    values[valid] = scale * Field(weights).eval(*grid_angles(valid))
    return Table(values)


@pytest.fixture(scope="module")
def fields(field):
    fields = {"matte": field((0.2, 0.1, 0.05), 0.05, 1.0), "glossy": field((0.05, 0.1, 0.2), 50.0, 80.0)}
    # All units at work, or the smallest field could be the material itself.
    noise = 0.05 * torch.randn(SIZE, generator=torch_generator(0, "fields"))
    return {name: weights + noise for name, weights in fields.items()}


def selection(fields, tables, settings=SETTINGS):
    return ModelSelection(
        LAYOUT, {unit: (name, fields[name]) for unit, name in units(LAYOUT).items()}, tables, settings, 0
    )


@pytest.fixture(scope="module")
def needs(fields):
    return selection(fields, {})


@pytest.fixture(scope="module")
def table(needs):
    return needs.table()


@pytest.fixture(scope="module")
def measured(fields):
    """A scene whose ball has a table that is a fifth brighter than its field."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "SMALLER", ["field-4", "field-12"])  # fits of all five take most of the time
        return selection(fields, {"glossy": tabulated(fields["glossy"], 1.2)}, SETTINGS | {"fit_steps": 40})


@pytest.fixture(scope="module")
def measured_table(measured):
    return measured.table()


def test_a_material_that_no_path_meets_needs_nothing(needs):
    assert needs.units == [("floor", 0), ("ball", 0)]


def test_the_ladder_of_a_field_ends_with_the_field_itself_which_shows_no_error(needs):
    for unit, models in needs.ladder.items():
        assert [model.rung for model in models][-len(SMALLER) - 1 :] == [*SMALLER, WIDEST]
        assert needs.errors[unit][-1] == 0 < min(needs.errors[unit][:-1])


def test_the_truth_of_a_source_is_its_table(measured, measured_table):
    """Its own field has an error, and fits go after the table."""
    assert measured.true["ball", 0].rung == "table" and measured.true["floor", 0].rung == WIDEST
    truth = measured_table.groupby("object")["truth"].unique()
    assert list(truth["ball"]) == ["table"] and list(truth["floor"]) == ["field"]
    assert measured.errors["ball", 0][-1] > 0.01
    assert min(measured.errors["ball", 0]) < measured.errors["ball", 0][-1]
    assert measured.errors["floor", 0][-1] == 0


def test_tolerances_below_the_error_of_the_field_are_marked(measured_table):
    ball = measured_table[measured_table["object"] == "ball"].set_index("tolerance")
    assert ball["fit_error"].nunique() == 1 and ball["fit_error"].iloc[0] > 0.005
    assert (ball["below_fit_error"] == (ball.index < ball["fit_error"])).all()
    assert ball["below_fit_error"].tolist()[0] and not ball["below_fit_error"].tolist()[-1]
    assert (measured_table["exceeds"] == (measured_table["measured"] > measured_table["tolerance"])).all()


def test_every_object_stays_within_the_tolerance_or_keeps_its_material(table):
    kept = table["rung"] == WIDEST
    assert (kept | ~table["exceeds"]).all()
    assert kept[table["tolerance"] == 1e-6].all() and (table["measured"][table["tolerance"] == 1e-6] == 0).all()
    assert (table["rung"][table["tolerance"] == 1.0] == "lambert").all()
    assert not table["below_fit_error"].any() and (table["fit_error"] == 0).all()


def test_what_is_reported_was_measured_on_fresh_seeds(needs, table, monkeypatch):
    """Pictures of the reporting seeds that are off change what is reported, and nothing that is chosen."""
    used, render = [], module.render

    def off(composition, samples, seed=0):
        used.append(seed)
        picture = render(composition, samples, seed)
        return picture * (1 + 0.2 * len(used)) if seed in (2, 3) else picture

    monkeypatch.setattr(module, "render", off)
    again = needs.table()
    assert set(used) == {0, 1, 2, 3, 4, 5}
    assert (again["chosen_seeds"] == "0 1").all() and (again["measured_seeds"] == "2 3").all()
    assert again["rung"].equals(table["rung"]) and again["upgrades"].equals(table["upgrades"])
    middle = table["tolerance"] == 0.03
    assert (again["measured"] > table["measured"])[middle & (table["rung"] != WIDEST)].all()
    assert again["exceeds"][middle].any()


def test_looser_tolerances_cost_no_more(table):
    summary = costs(table.assign(scene="test"))
    assert (summary["bytes"].diff().dropna() <= 0).all()
    assert summary["bytes_share"].iloc[0] == 1 and summary["kept"].tolist()[0] == 2
    assert summary["bytes"].iloc[-1] == 2 * 12
    assert (summary["noise"] > 0).all()


def test_the_chart_counts_the_objects_whose_fields_miss_the_tolerance(measured_table):
    summary = costs(measured_table.assign(scene="test"))
    # The floor reflects the ball.
    assert summary["below_fit_error"].tolist()[0] >= 1 and summary["below_fit_error"].tolist()[-1] == 0


def test_fits_are_better_where_they_were_fitted(needs):
    fits = needs.fits().groupby(["rung", "under"])[["error_scene", "error_angles"]].mean()
    scene, angles = (fits.xs(under, level="under").loc[SMALLER] for under in ("scene", "all angles"))
    assert scene["error_scene"].mean() < angles["error_scene"].mean()
    assert scene["error_angles"].mean() > angles["error_angles"].mean()
