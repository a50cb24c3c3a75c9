"""From the source store to AugMERL: the manifest, the projected columns, what the projection costs."""

import json
import time

import numpy as np
import pandas as pd

from neumat.augment.manifest import draw_manifest
from neumat.augment.pca import projection
from neumat.augment.permutations import PERMUTATIONS
from neumat.augment.store import AugMerl, write_store
from neumat.brdf.sources import gram, read_sources
from neumat.files import atomic_path
from neumat.seeds import numpy_generator

SERVED, SUBSET = 32, 8192  # materials and entries on which serving is timed


def build(sources_path, config, seed, store_path, manifest_path, report_path):
    """Write the store (HDF5), the manifest (TSV) and a table of what the PCA costs (CSV).

    The table also says how quickly the finished store serves. config: the section `augment`: blends, components,
    weight_range, held_out.
    """
    sources = read_sources(sources_path)
    manifest = draw_manifest(sources.names, config, seed)
    bases = manifest[:: len(PERMUTATIONS)]
    number = {name: i for i, name in enumerate(sources.names)}
    parents = bases[["parent_a", "parent_b"]].map(number.__getitem__).to_numpy()
    coefficients, kept = projection(gram(sources), config["components"])
    attributes = {"config": json.dumps(config), "seed": seed}
    negative, mean, largest = write_store(
        store_path, sources, coefficients, parents, bases["weight"].to_numpy(), attributes
    )
    table_ms, subset_ms = _serving_times(AugMerl(store_path, sources_path), seed)
    report = pd.DataFrame(
        [
            ("materials", len(manifest), "sources and blends in six colour permutations"),
            ("components", config["components"], "principal directions of the permuted sources that blends use"),
            ("variance_kept", kept, "share of the permuted sources' variance, linear reflectance"),
            ("projection_mean_log_change", mean, "mean |delta log(1 + f)| of a projected source's entries"),
            ("projection_largest_log_change", largest, "largest |delta log(1 + f)|"),
            ("negative_share", negative, "entries of projected sources below 0, set to 0 before blending"),
            ("table_ms", table_ms, "median wall time in which the finished store serves a material's whole table"),
            ("subset_ms", subset_ms, f"median wall time for {SUBSET} random entries"),
        ],
        columns=["quantity", "value", "meaning"],
    )
    with atomic_path(manifest_path) as path:
        manifest.to_csv(path, sep="\t", index=False)
    with atomic_path(report_path) as path:
        report.to_csv(path, index=False)


def _serving_times(store, seed):
    """Return the median milliseconds for a whole table and for SUBSET random entries."""
    positions = numpy_generator(seed, "served entries").integers(0, len(store.entries), SUBSET)
    count = len(PERMUTATIONS) * store.n
    times = []
    for index in np.linspace(count // 2, count - 1, SERVED, dtype=int):  # of the second half: blends, by default
        start = time.perf_counter()
        store.table(index)
        middle = time.perf_counter()
        store.values(index, positions)
        times.append((middle - start, time.perf_counter() - middle))
    return 1e3 * np.median(times, axis=0)
