"""How well fields reproduce the materials that they were fitted to: rendered PSNR and SSIM beside the losses."""

import numpy as np
import pandas as pd
import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.augment.store import AugMerl
from neumat.fields.store import PER_MATERIAL, read_neumerl
from neumat.metrics.pictures import compare_pictures
from neumat.render.sphere import FrozenSphere, render_fields
from neumat.render.tables import render_tables, table_matrix

AT_ONCE = 16
WORST = {"loss_grid": "idxmax", "loss_uniform": "idxmax", "psnr": "idxmin", "ssim": "idxmin"}
WORST |= {"loss_published": "idxmax"}


class Pictures:
    """Renders materials of an AugMERL store, from their tables, on the frozen sphere of `size` pixels."""

    def __init__(self, store, size):
        self.store, self.frozen = store, FrozenSphere(size)
        self.matrix, self.used = table_matrix(self.frozen, store.entries)

    def tables(self, indices):
        """Return the pictures (n, size, size, 3) uint8 of materials, as tabulated."""
        positions = self.used.numpy()
        values = [torch.from_numpy(self.store.values(index, positions)) for index in indices]
        return render_tables(self.frozen, self.matrix, torch.cat(values, 1))

    def fidelity(self, indices, weights):
        """Return (psnr, ssim) of fields (n, 675) against the tables of the materials."""
        return compare_pictures(self.tables(indices), render_fields(self.frozen, weights))


def fit_quality(neumerl_path, augmerl_path, sources_path, size, progress=iter):
    """Return a DataFrame with a row for each base material: set ("fitted"), name, losses, flags, rendered psnr (dB) and
    ssim."""
    neumerl = read_neumerl(neumerl_path)
    pictures = Pictures(AugMerl(augmerl_path, sources_path), size)
    bases = np.arange(0, len(neumerl.names), len(PERMUTATIONS))
    blocks = np.split(bases, range(AT_ONCE, len(bases), AT_ONCE))
    found = [pictures.fidelity(block, neumerl.weights[block]) for block in progress(blocks)]
    table = pd.DataFrame({key: neumerl.fits[key][bases] for key in PER_MATERIAL})
    table.insert(0, "set", "fitted")
    table.insert(1, "name", [neumerl.names[i] for i in bases])
    table["psnr"], table["ssim"] = np.concatenate(found, axis=1)
    return table


def fit_summary(table):
    """Return the means and the worst of each set of a table of fits: set, quantity, mean, median, worst, material.

    table: `fit_quality`'s with `measured_fits.fit_measured`'s below it. A set without any number has one row, whose
    quantity is the name that its only row has.
    """
    rows = []
    for name, part in table.groupby("set", sort=False):
        part = part.reset_index(drop=True)
        for key, worst in WORST.items():
            if key in part and part[key].notna().any():
                at = getattr(part[key], worst)()
                rows.append((name, key, part[key].mean(), part[key].median(), part[key][at], part["name"][at]))
        if part["psnr"].isna().all():
            rows.append((name, part["name"][0], *[np.nan] * 3, ""))
    return pd.DataFrame(rows, columns=["set", "quantity", "mean", "median", "worst", "worst_material"])
