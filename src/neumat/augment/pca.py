"""The PCA space of the permuted source materials, worked out from inner products alone.

Every permuted material's channels are columns of the source store, so the Gram matrix of the 6 N materials follows
from the (3N, 3N) Gram matrix of the columns, and a projection is a combination of the columns.
"""

import numpy as np

from neumat.augment.permutations import PERMUTATIONS, channel_order


def permuted_rows(n):
    """Return (6n, 3): the source columns that are the R, G and B of each permuted material, six to a material."""
    orders = np.array([channel_order(permutation) for permutation in PERMUTATIONS])
    return (3 * np.arange(n)[:, None, None] + orders).reshape(-1, 3)


def projection(gram, components):
    """Return (coefficients (3N, 3N), kept): what replaces each source column after projection, and the variance kept.

    gram: (3N, 3N) float64 inner products of the source columns. The sources are centred on the mean of the permuted
    materials, projected on the first `components` principal directions and put back; row k holds the weights of
    all columns in the projection of column k. Directions below the precision of the Gram matrix are left out.
    """
    rows = permuted_rows(len(gram) // 3)
    count = len(rows)
    kernel = sum(gram[np.ix_(rows[:, c], rows[:, c])] for c in range(3))
    centred = kernel - kernel.mean(0) - kernel.mean(1)[:, None] + kernel.mean()
    variance, vectors = np.linalg.eigh(centred)
    variance, vectors = variance[::-1], vectors[:, ::-1]
    usable = int((variance > 1e-12 * variance[0]).sum())
    basis = vectors[:, : min(components, usable)]
    weights = (1 / count + basis @ basis.T)[:: len(PERMUTATIONS)]  # of the unpermuted sources
    coefficients = np.zeros_like(gram)
    for c in range(3):
        np.add.at(coefficients[c::3].T, rows[:, c], weights.T)
    kept = variance[: basis.shape[1]].sum() / variance[:usable].sum()
    return coefficients, float(kept)
