"""k-means on the statistics of materials, for boundaries of reflectance beside the paper's (M3ashy, appendix D.4)."""

import numpy as np
import pandas as pd
from sklearn.cluster import KMeans

from neumat.errors import NeumatError
from neumat.studies.categories import PAPER_BOUNDARIES

CLUSTERS = 3
QUANTITIES = (*(f"{of}_{channel}" for of in ("mean", "maximum") for channel in "rgb"), "inner_maximum")


def cluster(values, logarithmic, seed=0):
    """Return (labels (n,), boundaries (k - 1,)) of one-dimensional k-means, k = CLUSTERS, labels in ascending order.

    values: (n,), positive where logarithmic. Boundaries lie midway between neighbouring centres, in the units of
    `values`. Raises NeumatError for fewer different values than clusters.
    """
    values = np.asarray(values, float)
    if len(np.unique(values)) < CLUSTERS:
        raise NeumatError("k-means", f"at least {CLUSTERS} different values", len(np.unique(values)))
    scaled = np.log(np.maximum(values, np.finfo(np.float32).tiny)) if logarithmic else values
    centres = np.sort(KMeans(CLUSTERS, n_init=10, random_state=seed).fit(scaled[:, None]).cluster_centers_[:, 0])
    boundaries = (centres[1:] + centres[:-1]) / 2
    return np.searchsorted(boundaries, scaled), np.exp(boundaries) if logarithmic else boundaries


def kmeans_table(statistics, seed=0):
    """Return the boundaries of `cluster` on mean and maximum reflectance of each channel, on both scales.

    Columns: quantity, scale, clusters, boundary_1 and boundary_2 (1/sr), materials in each cluster, and for maxima the
    paper's two thresholds.
    """
    rows = []
    for quantity in QUANTITIES:
        for scale in ("linear", "logarithmic"):
            labels, boundaries = cluster(statistics[quantity], scale == "logarithmic", seed)
            counts = np.bincount(labels, minlength=CLUSTERS)
            paper = PAPER_BOUNDARIES if "maximum" in quantity else (np.nan, np.nan)
            rows.append((quantity, scale, *boundaries, *paper, *counts))
    columns = ["quantity", "scale", "boundary_1", "boundary_2", "paper_1", "paper_2", "low", "middle", "high"]
    return pd.DataFrame(rows, columns=columns)
