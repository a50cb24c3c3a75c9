"""How near samples come to the training materials, against how near materials held out from training come.

Copies of training materials score well on every set metric; this is where they show.
"""

import pandas as pd

from neumat.metrics.distances import between
from neumat.metrics.materials import union
from neumat.metrics.near_copies import HELD_OUT, SAMPLES

NOVELTY_DISTANCES = ("brdf_l1_log", "msl")
NOVELTY_ENTRIES = 1024  # of the metric entries, evenly spread: enough for it


def nearest_training(materials, training, distance):
    """Return the distance (n,) of each material to its nearest training material, float64, and that one's index.

    materials, training: MaterialSet; distance: the name of a BRDF distance. Where no training material is at a
    finite distance, the distance is inf and the index 0.
    """
    nearest = between(distance, materials, training).nan_to_num(nan=float("inf")).min(1)
    return nearest.values, nearest.indices


def novelty(reference, samples, training, method, protocol):
    """Return one row for every sample and every held-out reference material and each of NOVELTY_DISTANCES.

    Columns: method, protocol, set (samples or held-out), item, distance, value, nearest (index of the nearest training
    material). reference, samples, training: MaterialSet (pictures are not needed).
    """
    probes = union(reference, samples)
    items = [(HELD_OUT, i) for i in range(len(reference))] + [(SAMPLES, i) for i in range(len(samples))]
    frames = []
    for distance in NOVELTY_DISTANCES:
        value, index = nearest_training(probes, training, distance)
        frame = pd.DataFrame(items, columns=["set", "item"])
        frames.append(frame.assign(distance=distance, value=value.numpy(), nearest=index.numpy()))
    result = pd.concat(frames, ignore_index=True)
    result.insert(0, "method", method)
    result.insert(1, "protocol", protocol)
    return result
