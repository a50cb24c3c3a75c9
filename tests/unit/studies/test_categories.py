import numpy as np
import pandas as pd
import pytest

from neumat.brdf.categories import CATEGORIES
from neumat.studies.categories import (
    names_table,
    overlap_table,
    readings_table,
    source_table,
    with_types,
)

RULES = {
    "f_diffuse": 1 / np.pi,
    "exceptions": 80_000,
    "metallic_share": 0.25,
    "specular": [100, 600],
    "plastic_tolerance": 0.05,
    "mirror_width": 0.0349,
}
NAMES = ["red-fabric", "chrome", "gray-plastic", "mine"]


@pytest.fixture
def statistics():
    """A fabric, a chrome that is metallic, a mirror and high-specular, a low-specular plastic, and one more of it."""
    table = pd.DataFrame(
        {
            "name": NAMES,
            "entries": 1_000_000,
            "exceeding": [100, 300_000, 100_000, 200_000],
            "minimum": [0.1, 0.01, 0.1, 0.1],
            "maximum": [0.5, 2000.0, 50.0, 60.0],
            "difference": [0.2, 500.0, 0.4, 20.0],
            "relative_difference": [0.4, 0.5, 0.3, 0.5],
            "peak": [0.1, 400.0, 2.0, 2.0],
            "half_width": [1.5, 0.002, 0.1, 0.1],
        }
    )
    for name in ("entries", "exceeding", "minimum", "maximum", "difference", "relative_difference"):
        table[f"inner_{name}"] = table[name]
    for k, channel in enumerate("rgb"):
        table[f"mean_{channel}"] = [0.1 + k, 50.0, 1.0, 2.0]
        table[f"maximum_{channel}"] = table["maximum"] - k * 0.1
    return table


@pytest.fixture
def types():
    rows = {"chrome": ("chrome", "metal"), "red-fabric": ("fabric", "fabric"), "gray-plastic": ("plastic", "plastic")}
    return pd.DataFrame.from_dict(rows, orient="index", columns=["type", "family"])


def test_types_follow_the_names(statistics, types):
    table = with_types(statistics, types)
    assert table["type"].tolist() == ["fabric", "chrome", "plastic", "unknown"]
    assert list(table)[:4] == ["name", "type", "family", "entries"]


def test_tables_by_hand(statistics, types):
    table = source_table(statistics, types, RULES)
    members = {category: set(table["name"][table[category]]) for category in CATEGORIES}
    assert members == {
        "diffuse": {"red-fabric"},
        "metallic": {"chrome"},
        "low-specular": {"gray-plastic", "mine"},
        "mid-specular": set(),
        "high-specular": {"chrome"},
        "plastic": {"gray-plastic"},
        "mirror": {"chrome"},
    }
    names = names_table(table).set_index("category")
    assert (names.loc["diffuse", ["named", "both"]] == 1).all() and names.loc["metallic", "precision"] == 1
    overlap = overlap_table(statistics, statistics, RULES).set_index(["set", "category"])
    assert overlap.loc[("sources", "low-specular"), "plastic"] == 1 == overlap.loc[("augmerl", "mirror"), "metallic"]


def test_readings_count_what_changes(statistics):
    fields = statistics.iloc[::-1].assign(exceeding=lambda table: table["exceeding"].where(table["name"] != "mine", 10))
    table = readings_table(statistics, fields.reset_index(drop=True), RULES).set_index(["category", "reading"])
    chosen = table.xs("chosen", level="reading")
    assert (chosen[["sources_changed", "augmerl_changed"]] == 0).all(axis=None)
    assert table.loc[("metallic", "printed: every direction")].tolist() == [0, 1, 0, 1]
    assert table.loc[("low-specular", "printed: diffuse materials as well")].tolist() == [3, 1, 3, 2]
    assert table.loc[("diffuse", "field instead of measured table")].tolist() == [2, 1, 2, 0]


def test_names_that_say_nothing_leave_an_empty_table_with_its_columns():
    member = {category: [True, False] for category in CATEGORIES}
    table = names_table(pd.DataFrame({"name": ["001", "NA"], "type": "unknown", "family": "unknown"} | member))
    assert len(table) == 0 and list(table)[:3] == ["category", "words", "named"] and "missed" in table
