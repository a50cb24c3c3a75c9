"""The materials that a layout names."""

import re

import torch

from neumat.augment.manifest import read_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.brdf.coordinates import ENTRIES
from neumat.brdf.table import Table
from neumat.errors import NeumatError
from neumat.fields.field import highlights
from neumat.fields.store import read_neumerl, read_samples


class Materials:
    """Finds a material by its name in the manifest ("chrome"), by number among the samples ("sample-3"), or by its rank
    among the sources or the samples, 0 for the lowest highlight and 1 for the highest ("sources@0.8")."""

    def __init__(self, neumerl_path, manifest_path, samples_path):
        fitted = read_neumerl(neumerl_path)
        rows = read_manifest(manifest_path)[:: len(PERMUTATIONS)]
        rows = rows[rows["parent_a"] == rows["parent_b"]]
        samples, _ = read_samples(samples_path)
        self.named = dict(zip(fitted.names, fitted.weights, strict=True))
        self.named |= {f"sample-{k}": weights for k, weights in enumerate(samples)}
        self.ranked = {
            "sources": _by_highlight(list(rows["name"]), self.named),
            "samples": _by_highlight([f"sample-{k}" for k in range(len(samples))], self.named),
        }

    def find(self, name):
        """Return (name, weights (675,)), the name in the manifest or "sample-<number>"; raises NeumatError for none."""
        ranked = re.fullmatch(r"(sources|samples)@([01](?:\.\d+)?)", name)
        if ranked and float(ranked[2]) <= 1:
            order = self.ranked[ranked[1]]
            name = order[round(float(ranked[2]) * (len(order) - 1))]
        if name not in self.named:
            raise NeumatError(
                "material", "a name of the manifest, sample-<number>, sources@<0..1> or samples@<0..1>", repr(name)
            )
        return name, self.named[name]


def stored_table(store, index):
    """Return the Table of material `index` of an AugMerl."""
    values = torch.full((ENTRIES, 3), torch.nan)
    values[torch.as_tensor(store.entries).long()] = torch.from_numpy(store.table(index)).float()
    return Table(values)


def stored_tables(names, manifest_path, store):
    """Return {name: Table} of those `names` that the manifest of an AugMerl has: sampled materials have no table."""
    rows = read_manifest(manifest_path)
    index = dict(zip(rows["name"], rows["index"], strict=True))
    return {name: stored_table(store, int(index[name])) for name in names if name in index}


def _by_highlight(names, named):
    """Return the names in order of the height of the highlight."""
    weights = torch.stack([named[name] for name in names])
    return [names[k] for k in highlights(weights).argsort()]
