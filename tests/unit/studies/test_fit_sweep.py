"""Chart 1's accounts: what a fit costs beside the published loop."""

from pathlib import Path

import pytest

from neumat.config import load
from neumat.studies.fit_sweep import PAPER, cost, variants

SCHEMA = Path(__file__).parents[3] / "workflow/schemas/config.schema.json"
PUBLISHED = {"m3ashy": 88_900_000, "nbrdf": 49_000_000}


def test_cost_tells_the_rate_from_the_budget_and_includes_the_first_field():
    # 4.5 M samples in 1.5 s against 1 M a second; 40 s of a first field that 400 materials start from.
    row = cost(4_500_000, 1.5, 40.0, 400, 1_000_000.0, PUBLISHED)
    assert row["first_seconds"] == pytest.approx(0.1)
    assert row["seconds"] == pytest.approx(1.6)
    assert row["rate_ratio"] == pytest.approx(3.0)
    assert row["speedup_m3ashy"] == pytest.approx(88.9 / 1.6)
    assert row["speedup_nbrdf"] == pytest.approx(49 / 1.6)


def test_speedups_fall_as_fewer_materials_share_the_first_field():
    few, many = (cost(1_000_000, 1.0, 30.0, served, 1e6, PUBLISHED) for served in (3, 300))
    assert few["speedup_nbrdf"] < many["speedup_nbrdf"]
    assert few["rate_ratio"] == many["rate_ratio"]


def test_the_published_schedule_is_fitted_with_the_samples_of_its_released_code():
    config = load({}, SCHEMA)
    family, _, fit, width = variants(config["fit"], PUBLISHED)[-1]
    assert (family, fit["samples"], fit["polish"]["samples"], width) == ("paper", 88_900_000, 0, 21)
    assert fit["batch_size"] == PAPER["batch_size"]


def test_the_default_budgets_are_those_of_the_sources_that_the_schema_names():
    """100 epochs of 80 % of the grid entries above the horizon, counted."""
    from neumat.brdf.coordinates import ENTRIES, cosines, grid_angles

    published = load({}, SCHEMA)["charts"]["published_samples"]
    cos_i, cos_o = cosines(*grid_angles(range(ENTRIES)))
    above = int(((cos_i > 0) & (cos_o > 0)).sum())
    assert published["m3ashy"] == pytest.approx(100 * 0.8 * above, rel=1e-3)
    assert published["nbrdf"] < published["m3ashy"]
