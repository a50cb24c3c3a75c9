"""The seven categories of reflectance (M3ashy, appendix D.4), as rules over `neumat.brdf.statistics`.

|f| is the largest channel, in 1/sr; valid entries are those with light and view above the horizon. No rule depends on
the order of the channels. Categories overlap. How the rules are read where the paper leaves it open, or where they
could not be met; `READINGS` holds the other ways, and results/tables/category_readings.csv counts what each changes:

diffuse: |f| > f_diffuse at fewer than `exceptions` valid entries. Entries below the horizon never exceed, so the count
    is the same over the whole grid of 1,458,000.
metallic: printed as |f| > f_diffuse in every direction. Such a material reflects more light than it gets by the very
    inequality that defines f_diffuse (but for turns among the channels), and no measured one comes near: |f| goes
    below .12 / sr in each. Read as: |f| > f_diffuse at a share of at least `metallic_share` of the valid entries; 1 is
    the printed rule. Most metals and metallic paints lie above a quarter, plastics below; chrome and steel lie below
    as well, since away from their narrow highlight they are dark.
low-, mid-, high-specular: the maximum of |f| lies in [f_diffuse, s1), [s1, s2), [s2, infinity), with `specular` =
    (s1, s2), and the material is not diffuse. Printed without the last condition, which makes almost every diffuse
    material low-specular: a few grazing entries pass f_diffuse. With it the four are disjoint.
plastic: wherever |f| > f_diffuse, the channels differ by less than `plastic_tolerance` of the material's maximum. As
    a share of |f| at the same entry no coloured plastic could pass, as its body colour is part of the sum. A material
    that never exceeds has no highlight that could be white: it is no plastic.
mirror: theta_h at which |f| (theta_h, 0, 0) has fallen to half of |f| (0, 0, 0) is below `mirror_width`. Printed as
    .349 rad (20 degrees), which takes in satin wood and metallic paint; no source lies between .033 and .057, and
    .0349 rad (2 degrees) parts polished from satin there: a lost zero is likely. |f| (0, 0, 0) is retro-reflection
    at normal incidence and not the maximum, which lies at grazing angles in nearly every measured material, but it
    is the top of that line, which is all that the width needs.
"""

import numpy as np
import pandas as pd

from neumat.errors import NeumatError

PRINTED_MIRROR_WIDTH = 0.349  # rad


def _finite(s):
    return np.isfinite(s[["mean_r", "mean_g", "mean_b", "maximum", "half_width"]]).all(axis=1)


def _diffuse(s, rules):
    return s["exceeding"] < rules["exceptions"]


def _metallic(s, rules):
    return s["exceeding"] >= rules["metallic_share"] * s["entries"]


def _maximum_from(s, low, high):
    return (s["maximum"] >= low) & (s["maximum"] < high)


def _low(s, rules):
    return _maximum_from(s, rules["f_diffuse"], rules["specular"][0]) & ~_diffuse(s, rules)


def _mid(s, rules):
    return _maximum_from(s, *rules["specular"]) & ~_diffuse(s, rules)


def _high(s, rules):
    return _maximum_from(s, rules["specular"][1], np.inf) & ~_diffuse(s, rules)


def _plastic(s, rules):
    return (s["exceeding"] > 0) & (s["difference"] < rules["plastic_tolerance"] * s["maximum"])


def _mirror(s, rules):
    return s["half_width"] < rules["mirror_width"]


_RULES = {
    "diffuse": _diffuse,
    "metallic": _metallic,
    "low-specular": _low,
    "mid-specular": _mid,
    "high-specular": _high,
    "plastic": _plastic,
    "mirror": _mirror,
}
CATEGORIES = tuple(_RULES)

# category -> {another reading: function(statistics, rules) -> bool (n,)}
READINGS = {
    "diffuse": {
        "exceptions scaled from the whole grid to the valid entries": lambda s, r: (
            s["exceeding"] < r["exceptions"] * s["entries"] / 1_458_000
        ),
        "no exceptions": lambda s, r: s["exceeding"] == 0,
        "without grazing entries": lambda s, r: s["inner_exceeding"] < r["exceptions"],
    },
    "metallic": {
        "printed: every direction": lambda s, r: s["minimum"] > r["f_diffuse"],
        "every direction but grazing ones": lambda s, r: s["inner_minimum"] > r["f_diffuse"],
        "every direction, with the exceptions of diffuse": lambda s, r: s["entries"] - s["exceeding"] < r["exceptions"],
        "the share, without grazing entries": lambda s, r: (
            s["inner_exceeding"] >= r["metallic_share"] * s["inner_entries"]
        ),
    },
    "low-specular": {
        "printed: diffuse materials as well": lambda s, r: _maximum_from(s, r["f_diffuse"], r["specular"][0]),
        "maximum without grazing entries": lambda s, r: (
            s["inner_maximum"].between(r["f_diffuse"], r["specular"][0], "left") & ~_diffuse(s, r)
        ),
    },
    "mid-specular": {
        "printed: diffuse materials as well": lambda s, r: _maximum_from(s, *r["specular"]),
        "maximum without grazing entries": lambda s, r: (
            s["inner_maximum"].between(*r["specular"], "left") & ~_diffuse(s, r)
        ),
    },
    "high-specular": {
        "printed: diffuse materials as well": lambda s, r: _maximum_from(s, r["specular"][1], np.inf),
        "maximum without grazing entries": lambda s, r: (s["inner_maximum"] >= r["specular"][1]) & ~_diffuse(s, r),
    },
    "plastic": {
        "also where nothing exceeds": lambda s, r: _plastic(s, r) | (s["exceeding"] == 0),
        "tolerance of the same direction's maximum": lambda s, r: (
            (s["exceeding"] > 0) & (s["relative_difference"] < r["plastic_tolerance"])
        ),
        "without grazing entries": lambda s, r: (
            (s["inner_exceeding"] > 0) & (s["inner_difference"] < r["plastic_tolerance"] * s["inner_maximum"])
        ),
        "four times the tolerance": lambda s, r: _plastic(s, {**r, "plastic_tolerance": 4 * r["plastic_tolerance"]}),
    },
    "mirror": {
        "printed: below .349 rad": lambda s, r: s["half_width"] < PRINTED_MIRROR_WIDTH,
    },
}


def categorise(statistics, rules):
    """Return a bool DataFrame (n, 7), columns CATEGORIES, of materials with these `statistics`.

    rules: the thresholds, config section `constrained.rules`; its f_diffuse is the one that the statistics were made
    with. A material with values that are not finite is in no category.
    """
    finite = _finite(statistics)
    return pd.DataFrame({name: rule(statistics, rules) & finite for name, rule in _RULES.items()})


def other_readings(statistics, rules):
    """Yield (category, reading, bool (n,)) for each of READINGS."""
    finite = _finite(statistics)
    for category, readings in READINGS.items():
        for reading, rule in readings.items():
            yield category, reading, rule(statistics, rules) & finite


def check_category(category):
    """Raise NeumatError where `category` is not one of CATEGORIES."""
    if category not in CATEGORIES:
        raise NeumatError("category", f"one of {', '.join(CATEGORIES)}", repr(category))


def check_rules(rules):
    """Raise NeumatError where the specular thresholds do not ascend from f_diffuse."""
    if not rules["f_diffuse"] < rules["specular"][0] < rules["specular"][1]:
        expected = f"two ascending numbers above f_diffuse = {rules['f_diffuse']:.4g}"
        raise NeumatError("config key constrained.rules.specular", expected, rules["specular"])
