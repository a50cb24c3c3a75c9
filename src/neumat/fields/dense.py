"""The dense set: its recipe from the sources' fields, and its fits, which cost a quarter of those of the paper's bases.

A fit starts from the interpolation of the parents' fields and not from the one field that all fits began with, so SOAP
alone will do: from there it stays as near to what all fields have in common as Adam gets from afar (the table
`dense.csv`). It sees a ninth of the grid, whose values are made for it.
"""

import copy
import math

import torch

from neumat.augment.dense import dense_values
from neumat.errors import NeumatError
from neumat.fields.fit import FILL, GROUP, OUTLIER, losses, soap, train
from neumat.fields.validity import ANGLES, directional_albedos

ENTRIES = 1 << 17  # of the grid, on which dense bases are fitted and judged


def largest_albedos(weights):
    """Return the largest directional albedo (n,), a float32 array, of each of the fields (n, 675), over channels and
    the light's ANGLES."""
    return directional_albedos(weights, ANGLES).amax((1, 2)).numpy()


def thinned(directions, count=ENTRIES):
    """Return at most `count` of the Directions as Directions of their own, of the training and of the held-out ones the
    same share, and the positions that they have among all."""
    share = min(1.0, count / len(directions.rows))
    held, train = (part[: math.ceil(share * len(part))] for part in (directions.held, directions.train))
    positions = torch.cat([held, train])
    part = copy.copy(directions)
    part.rows, part.uniform = directions.rows[positions], directions.uniform[positions]
    part.inputs, part.cosine = part.rows[:, :6], part.rows[:, 7:]
    part.held, part.train = torch.arange(len(held)), torch.arange(len(held), len(positions))
    return part, positions


def load_dense(sources, rows, positions):
    """Return the values (m, n, 3) float32 of the bases `rows` at positions (m,), as fits take them."""
    return torch.from_numpy(dense_values(sources, rows, positions.numpy())).transpose(0, 1).contiguous()


def fit_dense(values, directions, start, config, seed):
    """Fit K dense bases, at most GROUP; return a dict of tensors, as `fit.fit`.

    values: (V, K, 3), 1/sr; start: (K, 675), see `interpolated_fields`. config: of the section `fit` highlight_share,
    schedule, precision and `dense`, with samples, batch_size and learning_rate of its own. A fit that loses more than
    OUTLIER of what a constant loses has not converged, and one that diverges is left as it started. None is tried
    again: another base serves as well. Raises NeumatError for more than GROUP materials.
    """
    count = values.shape[1]
    if count > GROUP:
        raise NeumatError("fit", f"at most {GROUP} materials at a time", count)
    filled = torch.arange(math.ceil(count / FILL) * FILL) % count
    config = config | config["dense"]
    weights = train(values, directions, start[filled], config, soap, f"{seed}/dense")[:count]
    weights = torch.where(weights.isfinite().all(1, keepdim=True), weights, start)
    grid, uniform, null = losses(weights, values, directions, directions.held)
    found = {"weights": weights, "loss_grid": grid, "loss_uniform": uniform, "loss_constant": null}
    return found | {"converged": grid < OUTLIER * null, "retried": torch.zeros(count, dtype=torch.bool)}
