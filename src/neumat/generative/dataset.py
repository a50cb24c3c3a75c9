"""The training side of a protocol, from the stores."""

import logging

import numpy as np
import torch

from neumat.augment.dense import dense_indices
from neumat.augment.manifest import protocol_indices, read_manifest
from neumat.augment.pca import projection
from neumat.augment.permutations import PERMUTATIONS, channel_order
from neumat.brdf.sources import gram, read_sources
from neumat.errors import NeumatError
from neumat.fields.dense_store import read_dense_fields
from neumat.fields.layout import permute_channels
from neumat.fields.store import read_neumerl
from neumat.generative.base import Dataset


def training_dataset(neumerl, manifest, sources, protocol, components, model, dense=None):
    """Return the Dataset of `protocol` for the class `model`: with coefficients and gram where it models tables.

    neumerl, manifest, sources: paths. components: of the PCA space in which the blends were made. dense: path of the
    store of dense fields, which join those of a model of weights; None for the materials of the manifest alone.
    """
    manifest, fitted = read_manifest(manifest), read_neumerl(neumerl)
    train = training_indices(fitted, manifest, protocol)
    rows = manifest.iloc[train]
    weights = fitted.weights[torch.as_tensor(train)]
    permutation = rows["permutation"].map(PERMUTATIONS.index).to_numpy()
    is_source = (rows["parent_a"] == rows["parent_b"]).to_numpy()
    base = train // len(PERMUTATIONS)
    if model.kind == "weights":
        dataset = Dataset(weights, base, permutation, is_source)
        return dataset if dense is None else with_dense(dataset, read_dense_fields(dense), manifest, protocol)
    store = read_sources(sources)
    full = gram(store)
    table = coefficients(rows, store.names, projection(full, components)[0])
    products = full if model.stride == 1 else gram(store, model.stride)
    return Dataset(weights, base, permutation, is_source, table, products)


def with_dense(dataset, fields, manifest, protocol):
    """Return the Dataset with the DenseFields that `protocol` trains on, in the six orders of their channels, after it:
    those of `dense_indices` whose fits have converged."""
    train = dense_indices(fields.rows, manifest, protocol)
    train = train[fields.fits["converged"][train]]
    weights = fields.weights[torch.from_numpy(train)]
    six = len(PERMUTATIONS)
    return Dataset(
        torch.cat([dataset.weights, *(permute_channels(weights, order) for order in PERMUTATIONS)]),
        np.concatenate([dataset.base, len(manifest) // six + np.tile(train, six)]),
        np.concatenate([dataset.permutation, np.repeat(np.arange(six), len(train))]),
        np.concatenate([dataset.is_source, np.zeros(six * len(train), bool)]),
    )


def training_indices(fitted, rows, protocol):
    """Return the indices (n,) of the materials that a model is trained on under `protocol`: those of
    `protocol_indices` whose fits have converged. fitted: NeuMerl; rows: the manifest. Raises NeumatError where fewer
    than two have."""
    train, _ = protocol_indices(rows, protocol)
    good = fitted.fits["converged"][train]
    if not good.all():
        logging.warning("%d of %d materials are left out: their fits have not converged", (~good).sum(), len(good))
    if good.sum() < 2:
        raise NeumatError(f"training materials of {protocol}", "at least 2 whose fits have converged", good.sum())
    return train[good]


def coefficients(rows, names, projected):
    """Return (n, 3, 3N) float32: the channels of the manifest's `rows` as combinations of the N sources' columns.

    projected: (3N, 3N), the projection of each column that blends are made of; sources stay as measured. That
    blends take the projection's few negative entries as 0 is left out.
    """
    number = {name: i for i, name in enumerate(names)}
    a, b = (rows[parent].map(number).to_numpy() for parent in ("parent_a", "parent_b"))
    measured = np.eye(len(projected), dtype=np.float32).reshape(len(names), 3, -1)
    projected = projected.astype(np.float32).reshape(len(names), 3, -1)
    weight = rows["weight"].to_numpy(np.float32)[:, None, None]
    blends = weight * projected[a] + (1 - weight) * projected[b]
    plain = np.where((a == b)[:, None, None], measured[a], blends)
    order = np.array([channel_order(permutation) for permutation in rows["permutation"]])
    return np.take_along_axis(plain, order[:, :, None], axis=1)
