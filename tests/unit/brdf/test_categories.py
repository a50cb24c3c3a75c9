import json
import math
from pathlib import Path

import pandas as pd
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from neumat.brdf.analytic import GGX, Lambert
from neumat.brdf.categories import CATEGORIES, READINGS, categorise, check_category, check_rules, other_readings
from neumat.brdf.statistics import F_DIFFUSE, material_statistics
from neumat.errors import NeumatError

RULES = {
    "f_diffuse": F_DIFFUSE,
    "exceptions": 80_000,
    "metallic_share": 0.25,
    "specular": [100, 600],
    "plastic_tolerance": 0.05,
    "mirror_width": 0.0349,
}
PLAIN = {
    "entries": 1_111_428,
    "exceeding": 200_000,
    "minimum": 0.01,
    "maximum": 50.0,
    "difference": 10.0,
    "relative_difference": 0.3,
    "mean_r": 1.0,
    "mean_g": 1.0,
    "mean_b": 1.0,
    "peak": 5.0,
    "half_width": 0.2,
}


def of(**changes):
    """Statistics of one made-up material."""
    row = {**PLAIN, **changes}
    inner = ("entries", "exceeding", "minimum", "maximum", "difference")
    return pd.DataFrame([row | {f"inner_{name}": row[name] for name in inner}])


def categories(statistics, **rules):
    row = categorise(statistics, {**RULES, **rules}).iloc[0]
    return {name for name in CATEGORIES if row[name]}


class Sum:
    """A body colour under a highlight."""

    def __init__(self, *parts):
        self.parts = parts

    def eval(self, *angles):
        return sum(part.eval(*angles) for part in self.parts)


class Constant:
    def __init__(self, *value):
        self.value = torch.tensor(value)

    def eval(self, theta_h, theta_d, phi_d):
        return self.value.expand(len(theta_h), 3)


@pytest.mark.parametrize(
    ("material", "expected"),
    [
        (Lambert(0.5), {"diffuse"}),
        (Lambert([0.9, 0.1, 0.1]), {"diffuse"}),
        (Constant(0.4, 0.4, 0.4), {"metallic", "low-specular", "plastic"}),
        (Constant(0.4, 0.1, 0.1), {"metallic", "low-specular"}),
        # White and coloured highlights over no body colour.
        (GGX(0.02, 0.9), {"high-specular", "plastic", "mirror"}),
        (GGX(0.02, [0.9, 0.5, 0.2]), {"high-specular", "mirror"}),
    ],
)
def test_known_materials(material, expected):
    found = categories(material_statistics(material))
    assert found - {"metallic"} == expected - {"metallic"} and expected <= found


def test_a_coloured_body_leaves_a_plastic_white():
    row = material_statistics(Sum(Lambert([0.5, 0.05, 0.05]), GGX(0.1, 0.04)))
    assert "plastic" in categories(row)
    assert (row["relative_difference"] > RULES["plastic_tolerance"]).all()  # the other reading takes no such plastic


@pytest.mark.parametrize(
    ("category", "inside", "outside"),
    [
        ("diffuse", {"exceeding": 79_999}, {"exceeding": 80_000}),
        ("metallic", {"exceeding": 277_857}, {"exceeding": 277_856}),
        ("low-specular", {"maximum": F_DIFFUSE}, {"maximum": 100.0}),
        ("mid-specular", {"maximum": 100.0}, {"maximum": 600.0}),
        ("high-specular", {"maximum": 600.0}, {"maximum": 599.9}),
        ("plastic", {"difference": 2.49}, {"difference": 2.5}),
        ("mirror", {"half_width": 0.0348}, {"half_width": 0.0349}),
    ],
)
def test_thresholds(category, inside, outside):
    assert category in categories(of(**inside))
    assert category not in categories(of(**outside))


def test_metallic_as_printed_is_a_share_of_all():
    assert "metallic" in categories(of(exceeding=PLAIN["entries"]), metallic_share=1)
    assert "metallic" not in categories(of(exceeding=PLAIN["entries"] - 1), metallic_share=1)


def test_no_highlight_is_no_white_highlight():
    assert "plastic" not in categories(of(exceeding=0, difference=0.0, maximum=0.2))


@pytest.mark.parametrize("column", ["mean_g", "maximum", "half_width"])
def test_a_broken_material_is_in_no_category(column):
    assert categories(of(exceeding=0, **{column: math.nan})) == set()
    assert not any(member.any() for *_, member in other_readings(of(**{column: math.nan}), RULES))


@given(
    st.integers(0, PLAIN["entries"]),
    st.floats(F_DIFFUSE, 1e4),
    st.floats(0, 1e4),
    st.floats(0, math.pi / 2),
)
def test_diffuse_and_the_three_specular_are_a_partition(exceeding, maximum, difference, width):
    row = of(exceeding=exceeding, maximum=maximum, difference=difference, half_width=width)
    assert len(categories(row) - {"metallic", "plastic", "mirror"}) == 1


def test_every_category_but_none_else_has_readings():
    assert tuple(READINGS) == CATEGORIES
    assert {category for category, *_ in other_readings(of(), RULES)} == set(CATEGORIES)


def test_default_thresholds_are_those_of_the_schema():
    schema = json.loads((Path(__file__).parents[3] / "workflow/schemas/config.schema.json").read_text())
    rules = schema["properties"]["constrained"]["properties"]["rules"]["properties"]
    assert {name: key["default"] for name, key in rules.items()} == RULES


def test_mistakes_end_in_one_line():
    with pytest.raises(NeumatError, match=r"category: expected one of diffuse, .*; found 'shiny'"):
        check_category("shiny")
    for specular in ([600, 100], [0.1, 600]):
        with pytest.raises(NeumatError, match=r"constrained\.rules\.specular: expected two ascending numbers"):
            check_rules({**RULES, "specular": specular})
