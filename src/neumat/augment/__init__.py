"""AugMERL: permutations, blends in a PCA space, splits, the store."""
