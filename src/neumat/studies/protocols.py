"""The stages of evaluation: from the stores and the files of samples to rows of scores."""

import functools

import numpy as np
import pandas as pd
import torch

from neumat.augment.manifest import protocol_indices, read_manifest
from neumat.brdf.coordinates import GRID, grid_angles
from neumat.brdf.sources import read_sources
from neumat.errors import NeumatError
from neumat.fields.field import evaluate
from neumat.fields.store import read_neumerl, read_samples
from neumat.files import open_store, read_store, reading
from neumat.metrics import frechet, inception
from neumat.metrics.materials import MaterialSet, metric_entries
from neumat.metrics.score import Scorer
from neumat.render.sphere import FrozenSphere, render_fields
from neumat.render.tables import render_combinations, table_matrix
from neumat.seeds import numpy_generator

TRAINING_SET = "training-set"
WHAT = "a store of samples"


class Protocol:
    """One protocol's materials, and how samples become MaterialSets beside them.

    neumerl, manifest, sources: paths. entries: how many metric entries; size: of the pictures, pixels.
    Attributes: weights (2400, 675) of all materials; train, reference: indices into them.
    """

    def __init__(self, name, neumerl, manifest, sources, entries, size, seed):
        self.name, self.seed = name, seed
        self.train, self.reference = protocol_indices(read_manifest(manifest), name)
        self.weights = read_neumerl(neumerl).weights
        self.store = read_sources(sources)
        self.entries = metric_entries(self.store.entries, entries, seed)
        self.frozen = FrozenSphere(size)

    def fields(self, weights, pictures=True, step=1):
        """Return the MaterialSet of neural fields, weights (n, 675), at every step-th metric entry."""
        entries = self.entries[::step]
        brdf = evaluate(weights, *grid_angles(entries))
        return MaterialSet(entries, brdf, render_fields(self.frozen, weights) if pictures else None)

    def materials(self, indices, pictures=True, step=1):
        """Return the MaterialSet of some of the 2400 materials."""
        return self.fields(self.weights[torch.as_tensor(indices)], pictures, step)

    def combinations(self, coefficients, pictures=True, stride=1):
        """Return the MaterialSet of tables, given as coefficients (n, 3, 3N) of the sources' columns.

        stride: 2 for tables of 45 x 45 x 90, read as M3ashy does by their nearest lower entry (its appendix C.4).
        """
        matrix, used = table_matrix(self.frozen, self.store.entries)
        held = coarse_positions(self.store.entries, stride)
        positions = held[np.concatenate([np.searchsorted(self.store.entries, self.entries), used])]
        values, queries = [], []
        for i in range(self.store.n):
            table = torch.from_numpy(self.store.values(i, positions))
            values.append(table[: len(self.entries)].clone())  # a view would keep the whole table
            if pictures:
                queries.append(matrix @ table[len(self.entries) :])
        brdf = (coefficients @ torch.cat(values, 1).T).clamp_min(0).transpose(1, 2).contiguous()
        images = render_combinations(self.frozen, torch.cat(queries, 1), coefficients) if pictures else None
        return MaterialSet(self.entries, brdf, images)

    def samples(self, path, pictures=True):
        """Return the MaterialSet of a file of samples, fields or tables. Raises NeumatError for another file."""
        with open_store(path, WHAT, {}) as file, reading(path, WHAT):
            kind, stride = file.attrs.get("kind"), file.attrs.get("stride")
        if kind == "weights":
            return self.fields(read_samples(path)[0], pictures)
        if kind != "table" or stride not in (1, 2):
            raise NeumatError(path, f"{WHAT} of kind weights or table", f"kind {kind}, stride {stride}")
        arrays, _ = read_store(path, WHAT, {"samples": ("numbers", ("n", 3, 3 * self.store.n))})
        return self.combinations(torch.from_numpy(arrays["samples"]).float(), pictures, int(stride))

    def training_draws(self, draws, size):
        """Return the MaterialSet of `draws` sets of `size` training materials, each drawn without replacement."""
        chosen = [
            numpy_generator(self.seed, TRAINING_SET, self.name, draw).permutation(self.train)[:size]
            for draw in range(draws)
        ]
        return self.materials(np.concatenate(chosen))


def coarse_positions(entries, stride):
    """Return (V,): for each entry the position of the one that stands for it on a grid of every stride-th entry.

    That is the entry at its indices rounded down to multiples of `stride`; where it is invalid, the entry itself.
    """
    i, j, k = (index - index % stride for index in np.unravel_index(entries, GRID))
    below = np.ravel_multi_index((i, j, k), GRID)
    positions = np.searchsorted(entries, below)
    return np.where(entries[positions] == below, positions, np.arange(len(entries)))


def score_protocol(protocol, samples, draws, size, inception_path, progress=iter):
    """Return the rows of scores of the training set and of every method.

    samples: {method: path of its samples}; draws, size: of the training set's draws, and of the samples'.
    inception_path: pytorch-fid's weights (`neumat.metrics.inception`); empty scores without Inception's features.
    """
    features = {frechet.NAME: frechet.features}
    if inception_path:
        weights = inception.read_weights(inception_path)
        features[inception.NAME] = functools.partial(inception.features, weights=weights)
    scorer = Scorer(protocol.materials(protocol.reference), protocol.name, protocol.seed, features)
    scores = []
    for method, path in progress({TRAINING_SET: None, **samples}.items()):
        found = protocol.samples(path) if path else protocol.training_draws(draws, size)
        scores.append(scorer.score(found, draws, method))
    return pd.concat(scores, ignore_index=True)
