"""How near samples come to the training materials, against how near materials held out from training come.

Copies of training materials score well on every set metric; this is where they show.
"""

import pandas as pd

from neumat.metrics.distances import between
from neumat.metrics.near_copies import HELD_OUT, SAMPLES

NOVELTY_DISTANCES = ("brdf_l1_log", "msl")
NOVELTY_ENTRIES = 1024  # of the metric entries, evenly spread: enough for it
COLUMNS = ["method", "protocol", "set", "item", "distance", "value", "nearest"]


def nearest_training(materials, training, distance):
    """Return the distance (n,) of each material to its nearest training material, float64, and that one's index.

    materials, training: MaterialSet; distance: the name of a BRDF distance. Where no training material is at a
    finite distance, the distance is inf and the index 0.
    """
    nearest = between(distance, materials, training).nan_to_num(nan=float("inf")).min(1)
    return nearest.values, nearest.indices


def nearest_rows(materials, training):
    """Return one row for each of NOVELTY_DISTANCES and each of `materials`: item, distance, value, nearest (index of
    the nearest training material). materials, training: MaterialSet (pictures are not needed)."""
    frames = []
    for distance in NOVELTY_DISTANCES:
        value, index = nearest_training(materials, training, distance)
        columns = {
            "item": range(len(materials)),
            "distance": distance,
            "value": value.numpy(),
            "nearest": index.numpy(),
        }
        frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def novelty(held_out, samples, method, protocol):
    """Return the `nearest_rows` of the held-out reference materials and of a method's samples as one DataFrame.

    Columns: method, protocol, set (samples or held-out), item, distance, value, nearest.
    """
    result = pd.concat([held_out.assign(set=HELD_OUT), samples.assign(set=SAMPLES)], ignore_index=True)
    return result.assign(method=method, protocol=protocol)[COLUMNS]
