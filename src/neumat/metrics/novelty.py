"""How near samples come to the training materials, against how near materials held out from training come.

Copies of training materials score well on every set metric; this is where they show.
"""

import pandas as pd

from neumat.metrics.distances import between
from neumat.metrics.materials import union

NOVELTY_DISTANCES = ("brdf_l1_log", "msl")
NOVELTY_ENTRIES = 1024  # of the metric entries, evenly spread: enough for it
NEAR_COPY_QUANTILE = 0.05
HELD_OUT, SAMPLES = "held-out", "samples"


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


def novelty_summary(rows):
    """Return one row per method, protocol and distance of `novelty` rows: the medians of the distances to training
    of samples and of held-out materials, and the share of near copies in percent, which are the samples no farther
    from training than the nearest 5 % of the held-out (the threshold)."""
    summary = []
    for (method, protocol, distance), group in rows.groupby(["method", "protocol", "distance"], sort=False):
        held_out = group.loc[group["set"] == HELD_OUT, "value"]
        samples = group.loc[group["set"] == SAMPLES, "value"]
        threshold = held_out.quantile(NEAR_COPY_QUANTILE)
        summary.append(
            {
                "method": method,
                "protocol": protocol,
                "distance": distance,
                "median": samples.median(),
                "held_out_median": held_out.median(),
                "threshold": threshold,
                "near_copies_percent": 100 * (samples <= threshold).mean(),
                "n_samples": len(samples),
                "n_held_out": len(held_out),
            }
        )
    return pd.DataFrame(summary)
