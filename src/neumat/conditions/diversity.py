"""Of many fields, those that differ most."""

import torch

from neumat.brdf.coordinates import grid_angles
from neumat.brdf.statistics import valid_entries
from neumat.fields.field import evaluate

EVERY = 2003  # fields are compared at each so many-th valid entry of the MERL grid: at some 550


def most_different(weights, n):
    """Return positions (r, n) within each row of fields (r, m, 675), m >= n: the most typical one, then one after the
    other that which is farthest from those before it (Gonzalez 1985), by mean |log(1 + f) - log(1 + f')|.

    The most typical one is the medoid. Outliers, the quarter of a row that is farthest from it, are left out while
    there are enough others: of all that is far, they would be chosen first.
    """
    values = evaluate(weights.flatten(0, 1), *grid_angles(valid_entries()[::EVERY]))
    values = torch.log1p(values).flatten(1).view(*weights.shape[:2], -1)
    rows = torch.arange(len(values))
    between = torch.stack([(values - values[:, k : k + 1]).abs().mean(2) for k in range(values.shape[1])], 1)
    chosen = [between.sum(2).argmin(1)]
    distance = between[rows, chosen[0]]
    outside = distance.argsort(1)[:, max(n, 3 * values.shape[1] // 4) :]
    distance.scatter_(1, outside, -1)
    distance[rows, chosen[0]] = -1  # not again, even where all others are copies
    while len(chosen) < n:
        chosen.append(distance.argmax(1))
        distance = torch.minimum(distance, between[rows, chosen[-1]])
        distance[rows, chosen[-1]] = -1
    return torch.stack(chosen, 1)
