"""Fits of measured materials: the embedded tables are smooth, and easier to fit than a measurement with its noise.

Of the files, sorted by name, the first two thirds are for validation: settings are chosen on them. The rest report.
"""

from pathlib import Path

import pandas as pd
import torch

from neumat.brdf.sources import LARGEST
from neumat.errors import NeumatError
from neumat.export.reading import read_material
from neumat.fields.fit import Directions, fit, losses
from neumat.fields.store import PER_MATERIAL, read_first
from neumat.metrics.pictures import compare_pictures
from neumat.render.sphere import FrozenSphere, render_fields
from neumat.render.tables import render_tables, table_matrix

PUBLISHED = ".h5"
SETS = VALIDATION, REPORTING, NONE = "measured, validation", "measured, reporting", "not measured"


def sets(names):
    """Return {name: VALIDATION or REPORTING} of material names: at least one reports."""
    ordered = sorted(names)
    chosen = 2 * len(ordered) // 3
    return {name: VALIDATION if k < chosen else REPORTING for k, name in enumerate(ordered)}


class MeasuredMaterials:
    """Measured materials on the MERL grid, at the entries that are valid in all of them.

    files: paths of .bsdf and .binary files, and of published fields of the same names (Keras, .h5); size: of the
    pictures. Attributes: names, sets {name: VALIDATION or REPORTING}. Raises NeumatError for a bad file, and for
    values that float16 cannot hold.
    """

    def __init__(self, files, size, seed):
        published = {Path(path).stem: path for path in files if Path(path).suffix == PUBLISHED}
        paths = {Path(path).stem: path for path in files if Path(path).suffix != PUBLISHED}
        self.names, self.sets = sorted(paths), sets(paths)
        tables = [read_material(paths[name]) for name in self.names]
        for name, table in zip(self.names, tables, strict=True):
            if table.values.max() > LARGEST:
                raise NeumatError(paths[name], f"values of at most {LARGEST:.0f} / sr", f"{table.values.max():.6g}")
        entries = torch.stack([table.valid for table in tables]).all(0).nonzero()[:, 0]
        self.directions = Directions(entries, seed)
        self.values = torch.stack([table.values[entries] for table in tables], 1).half()
        self.frozen = FrozenSphere(size)
        matrix, used = table_matrix(self.frozen, entries)
        self.pictures = render_tables(self.frozen, matrix, self.values[used].float().flatten(1))
        self.published = {name: self._loss(name, read_material(path)) for name, path in published.items()}

    def _loss(self, name, weights):
        """Return the held-out loss over the grid of a field (675,) that others have fitted to a material."""
        at = self.names.index(name)
        return float(losses(weights[None], self.values[:, [at]], self.directions, self.directions.held)[0])

    def fit(self, chosen, first, config, seed):
        """Return a DataFrame with a row for each material of the `chosen` sets, fitted from the weights `first` (675,).

        set, name, losses and flags of `fields.fit.fit`, rendered psnr (dB) and ssim; loss_published: the held-out
        `loss_grid` of the published field of that name, NaN where there is none.
        """
        at = [k for k, name in enumerate(self.names) if self.sets[name] in chosen]
        found = fit(self.values[:, at], self.directions, first, config, seed)
        table = pd.DataFrame({key: found[key].numpy() for key in PER_MATERIAL})
        names = [self.names[k] for k in at]
        table.insert(0, "set", [self.sets[name] for name in names])
        table.insert(1, "name", names)
        table["psnr"], table["ssim"] = compare_pictures(self.pictures[at], render_fields(self.frozen, found["weights"]))
        table["loss_published"] = [self.published.get(name, float("nan")) for name in names]
        return table


def fit_measured(files, first_path, config, size, seed):
    """Return the DataFrame of `MeasuredMaterials.fit`, of both sets, with the settings of a run's own materials.

    files: see MeasuredMaterials; without any, one row says that nothing was measured. first_path: the run's first
    field; config: the section `fit`.
    """
    if not files:
        return pd.DataFrame([{"set": "measured", "name": NONE}])
    return MeasuredMaterials(files, size, seed).fit((VALIDATION, REPORTING), read_first(first_path), config, seed)
