"""Of many fields, those that differ most."""

import torch

from neumat.brdf.coordinates import grid_angles
from neumat.brdf.statistics import valid_entries
from neumat.fields.field import evaluate

EVERY = 2003  # fields are compared at each so many-th valid entry of the MERL grid: at some 550


def most_different(weights, n):
    """Return positions (r, n) within each row of fields (r, m, 675), m >= n: the first one, then one after the other
    that which is farthest from those before it (Gonzalez 1985), by mean |log(1 + f) - log(1 + f')|."""
    values = evaluate(weights.flatten(0, 1), *grid_angles(valid_entries()[::EVERY]))
    values = torch.log1p(values).flatten(1).view(*weights.shape[:2], -1)
    rows = torch.arange(len(values))
    chosen = [torch.zeros(len(values), dtype=torch.int64)]
    distance = torch.full(values.shape[:2], torch.inf)
    while len(chosen) < n:
        latest = values[rows, chosen[-1]][:, None]
        distance = torch.minimum(distance, (values - latest).abs().mean(2))
        distance[rows, chosen[-1]] = -1  # not again, even where all others are copies
        chosen.append(distance.argmax(1))
    return torch.stack(chosen, 1)
