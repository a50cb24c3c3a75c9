"""From the source store to AugMERL: the manifest, the projected columns, what the projection costs."""

import json

import pandas as pd

from neumat.augment.manifest import draw_manifest
from neumat.augment.pca import projection
from neumat.augment.permutations import PERMUTATIONS
from neumat.augment.store import write_store
from neumat.brdf.sources import gram, read_sources
from neumat.files import atomic_path


def build(sources_path, config, seed, store_path, manifest_path, report_path):
    """Write the store (HDF5), the manifest (TSV) and a table of what the PCA costs (CSV).

    config: the section `augment`: blends, components, weight_range, held_out.
    """
    sources = read_sources(sources_path)
    manifest = draw_manifest(sources.names, config, seed)
    bases = manifest[:: len(PERMUTATIONS)]
    number = {name: i for i, name in enumerate(sources.names)}
    parents = bases[["parent_a", "parent_b"]].map(number.__getitem__).to_numpy()
    coefficients, kept = projection(gram(sources_path), config["components"])
    attributes = {"config": json.dumps(config), "seed": seed}
    negative, mean, largest = write_store(
        store_path, sources, coefficients, parents, bases["weight"].to_numpy(), attributes
    )
    report = pd.DataFrame(
        [
            ("materials", len(manifest), "sources and blends in six colour permutations"),
            ("components", config["components"], "principal directions of the permuted sources that blends use"),
            ("variance_kept", kept, "share of the permuted sources' variance, linear reflectance"),
            ("projection_mean_log_change", mean, "mean |delta log(1 + f)| of a projected source's entries"),
            ("projection_largest_log_change", largest, "largest |delta log(1 + f)|"),
            ("negative_share", negative, "entries of projected sources below 0, set to 0 before blending"),
        ],
        columns=["quantity", "value", "meaning"],
    )
    with atomic_path(manifest_path) as path:
        manifest.to_csv(path, sep="\t", index=False)
    with atomic_path(report_path) as path:
        report.to_csv(path, index=False)
