"""The stages that make the dense set: the recipe, the shards of fits, the gathering."""

import numpy as np

from neumat.augment.dense import draw_dense, read_dense
from neumat.augment.manifest import read_manifest, source_rows
from neumat.brdf.sources import read_sources
from neumat.errors import NeumatError
from neumat.fields.dense import fit_dense, largest_albedos, load_dense, thinned
from neumat.fields.dense_store import write_dense
from neumat.fields.fit import GROUP, Directions
from neumat.fields.interpolation import interpolated_fields
from neumat.fields.shards import read_shard, write_shard
from neumat.fields.store import FITS, read_neumerl
from neumat.files import atomic_path

SHARD = "a shard of dense fits"


def write_recipe(manifest_path, neumerl_path, config, seed, path):
    """Draw the dense bases of the config's section `augment.dense` and write them as TSV."""
    manifest = read_manifest(manifest_path)
    sources = read_neumerl(neumerl_path).weights[source_rows(manifest)["index"].to_numpy().copy()]
    rows = draw_dense(manifest, largest_albedos(sources), config, seed)
    with atomic_path(path) as temporary:
        rows.to_csv(temporary, sep="\t", index=False)


def fit_dense_shard(recipe_path, sources_path, neumerl_path, indices, config, seed, path, progress=iter):
    """Fit the bases `indices` of the recipe and write weights, losses and flags: one shard of the dense set."""
    rows, sources, fitted = read_dense(recipe_path), read_sources(sources_path), read_neumerl(neumerl_path)
    directions, positions = thinned(Directions(sources.entries, seed))
    results = []
    for start in progress(range(0, len(indices), GROUP)):
        group = rows.iloc[indices[start : start + GROUP]]
        begun = interpolated_fields(group, fitted, neumerl_path)
        results.append(fit_dense(load_dense(sources, group, positions), directions, begun, config, seed))
    write_shard(path, indices, results, config)


def gather_dense(shard_paths, recipe_path, path):
    """Gather the shards into the store of the dense set.

    A fit that has not converged stays, flagged: no model is trained on it. Raises NeumatError for a shard that is
    damaged and for a base that no shard has.
    """
    rows, found, seen = read_dense(recipe_path), {}, []
    for shard_path in shard_paths:
        arrays, config = read_shard(shard_path, SHARD)
        seen.append(arrays["index"])
        for key in FITS:
            found.setdefault(key, []).append(arrays[key])
    order = np.concatenate(seen)
    if sorted(order) != list(range(len(rows))):
        raise NeumatError(path, f"fits of all {len(rows)} dense bases, once each", f"{len(order)} fits")
    found = {key: np.concatenate(parts)[order.argsort()] for key, parts in found.items()}
    write_dense(path, rows, found["weights"], found, config)
