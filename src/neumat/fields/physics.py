"""Physical plausibility, material by material: reciprocity, directional albedo, energy gained, and what programs show
that do not fold phi_d."""

import math

import numpy as np
import pandas as pd

from neumat.brdf.coordinates import half_difference, rusinkiewicz
from neumat.brdf.validity import directional_albedo
from neumat.fields.field import evaluate_inputs
from neumat.fields.mirrored import LIMIT, random_pairs, unfolded_error
from neumat.fields.validity import directional_albedos

EVEN = 8  # angles of the light, at equal steps of sin^2: the mean of their albedos is the hemispherical albedo
GRAZING = (80, 85, 89.9)  # degrees; some fields create energy beyond 85 only
ANGLES = (
    *(math.asin(math.sqrt((i + 0.5) / EVEN)) for i in range(EVEN)),
    *(math.radians(angle) for angle in GRAZING),
)
PAIRS = 512  # of random directions, at which reciprocity is measured
RESOLUTION = 64  # of the quadrature of a single material, along both half angles


def largest_albedo(material):
    """Return the largest directional albedo of a material, over ANGLES and channels; above 1 it creates energy."""
    return max(directional_albedo(material, angle, RESOLUTION).max().item() for angle in ANGLES)


def physics_table(names, weights):
    """Return a DataFrame with a row for each of the fields (n, 675), those that gain most first.

    material; reciprocity: largest |f(i, o) - f(o, i)| / (1 + f(i, o)) over random directions; albedo: hemispherical,
    mean of the channels; largest_albedo: directional, of all ANGLES and channels, and its angle in degrees; gain: what
    is reflected beyond what is received, as a share of the latter; flagged: whether there is any, or a value is not a
    number; rescale: the factor that ends it, which the BSDF applies with `conserve`.
    """
    albedos = directional_albedos(weights, ANGLES).numpy()
    per_angle = albedos.max(2)
    largest = per_angle.max(1)
    table = pd.DataFrame({"material": names, "reciprocity": _reciprocity(weights).numpy()})
    table["albedo"] = albedos[:, :EVEN].mean((1, 2))
    table["largest_albedo"] = largest
    table["angle"] = np.degrees(ANGLES)[per_angle.argmax(1)].round(1)
    table["gain"] = np.maximum(largest - 1, 0)
    table["flagged"] = ~(largest <= 1)  # what is not a number fails every comparison
    table["rescale"] = 1 / np.maximum(largest, 1)
    return table.sort_values("largest_albedo", ascending=False, kind="stable")


def unfolded_table(sets):
    """Return a DataFrame with a row for each of `sets` {name: weights (n, 675)}: set, materials; median and worst, the
    `unfolded_error`, over other pairs of directions than samples are mended and checked at; above_10_percent, of how
    many materials it is larger than that."""
    rows = []
    for name, weights in sets.items():
        error = unfolded_error(weights, "report")
        worst = error.nan_to_num(math.inf).max().item()
        rows.append((name, len(error), error.nanmedian().item(), worst, int((~(error <= LIMIT)).sum())))
    return pd.DataFrame(rows, columns=["set", "materials", "median", "worst", "above_10_percent"])


def _reciprocity(weights):
    """Return the largest relative difference (n,) between f(i, o) and f(o, i), of fields (n, 675)."""
    wi, wo = random_pairs(PAIRS)
    one, other = (
        evaluate_inputs(weights, half_difference(*rusinkiewicz(*both)).to(weights.dtype))
        for both in ((wi, wo), (wo, wi))
    )
    return ((one - other).abs() / (1 + one)).flatten(1).amax(1)
