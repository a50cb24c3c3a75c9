"""Statistics of neural fields over the whole MERL grid, evaluated in blocks that stay in the cache."""

import pandas as pd
import torch

from neumat.augment.permutations import PERMUTATIONS, channel_order
from neumat.brdf.coordinates import grid_angles, half_difference
from neumat.brdf.statistics import CHANNELS, COUNTS, F_DIFFUSE, LINE, split, statistics, valid_entries
from neumat.fields.field import MATERIALS, POINTS, reflectance, with_biases
from neumat.fields.layout import permute_channels


class FieldStatistics:
    """Called with weights (n, 675) float32, returns their `neumat.brdf.statistics.statistics`, n rows.

    f_diffuse: 1/sr. every: only each so many-th entry is looked at; counts are scaled to all of them. It holds the
    inputs of these entries (31 MB for all that lie above the horizon).
    """

    def __init__(self, f_diffuse=F_DIFFUSE, every=1):
        self.f_diffuse, self.every = f_diffuse, every
        entries = valid_entries()
        self._parts = [_columns(entries[positions[::every]]).split(POINTS, 1) for positions in split(entries)]
        self._line = _columns(LINE)

    @torch.no_grad()
    def __call__(self, weights, progress=iter):
        tables = [self._block(block) for block in progress(weights.split(MATERIALS))]
        table = pd.concat(tables, ignore_index=True)
        table[list(COUNTS)] *= self.every
        return table

    def _block(self, weights):
        layers = with_biases(weights)
        inner, grazing = ((reflectance(layers, points) for points in part) for part in self._parts)
        return statistics(len(weights), inner, grazing, reflectance(layers, self._line), self.f_diffuse)


def _columns(entries):
    """Return the inputs (7, m) of `neumat.fields.field.reflectance`."""
    inputs = half_difference(*grid_angles(entries))
    return torch.cat([inputs.T, torch.ones(1, len(entries))])


def neumerl_statistics(store, f_diffuse=F_DIFFUSE, progress=iter):
    """Return the statistics of the materials of a NeuMerl, after a column `name`.

    The six orders of a material's channels are evaluated once where their weights are exact permutations.
    """
    six = len(PERMUTATIONS)
    first = store.weights[::six]
    shared = all(
        torch.equal(store.weights[k::six], permute_channels(first, order)) for k, order in enumerate(PERMUTATIONS)
    )
    table = FieldStatistics(f_diffuse)(first if shared else store.weights, progress)
    if shared:
        table = table.loc[table.index.repeat(six)].reset_index(drop=True)
        plain = table[list(CHANNELS)].to_numpy()
        for k, order in enumerate(PERMUTATIONS):
            taken = channel_order(order)
            table.loc[k::six, list(CHANNELS)] = plain[k::six][:, taken + [3 + c for c in taken]]
    table.insert(0, "name", store.names)
    return table
