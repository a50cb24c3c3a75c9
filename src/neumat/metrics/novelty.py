"""How near materials come to the training materials."""

from neumat.metrics.distances import between

NOVELTY_ENTRIES = 1024  # of the metric entries, evenly spread: enough for it


def nearest_training(materials, training, distance):
    """Return the distance (n,) of each material to its nearest training material, float64, and that one's index.

    materials, training: MaterialSet; distance: the name of a BRDF distance. Where no training material is at a
    finite distance, the distance is inf and the index 0.
    """
    nearest = between(distance, materials, training).nan_to_num(nan=float("inf")).min(1)
    return nearest.values, nearest.indices
