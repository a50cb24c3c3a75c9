"""How well a set of samples matches a reference set, from tables of distances (M3ashy, equations 3 to 5).

Tables are float tensors: `reference_sample` (r, s), `reference_reference` (r, r), `sample_sample` (s, s).

Ties count as what random tie breaking gives on average, so no result depends on the order of the materials, and
copies of a reference are not favoured. A distance that is not finite is never a nearest one: a broken sample is
counted in its set, covers nothing, and matches nothing.
"""

import torch


def mmd(reference_sample):
    """Return the mean distance from a reference to its nearest sample (equation 3); inf where one has none."""
    return _nearest_first(reference_sample).min(1).values.mean().item()


def cov(reference_sample):
    """Return the share of references that are the nearest one of at least one sample (equation 4), in [0, 1]."""
    missed = 1 - _nearest_share(_nearest_first(reference_sample.T))  # (s, r)
    return 1 - missed.prod(0).mean().item()


def one_nna(reference_sample, reference_reference, sample_sample):
    """Return the leave-one-out accuracy of a nearest-neighbour classifier (equation 5), in [0, 1]; 0.5 is best.

    A material without any neighbour at a finite distance is told apart at sight: it counts as classified.
    """
    r = len(reference_reference)
    table = torch.cat(
        [
            torch.cat([reference_reference, reference_sample], 1),
            torch.cat([reference_sample.T, sample_sample], 1),
        ]
    )
    table = _nearest_first(table).fill_diagonal_(torch.inf)
    share = _nearest_share(table)
    is_reference = torch.arange(len(table)) < r
    right = (share * (is_reference[:, None] == is_reference)).sum(1)
    return torch.where(share.sum(1) > 0, right, 1.0).mean().item()


def _nearest_first(table):
    """Return a float64 copy in which every distance that is not finite is inf."""
    table = torch.as_tensor(table).double()
    return torch.where(torch.isfinite(table), table, torch.inf)


def _nearest_share(table):
    """Return, per row, the probability of each column to be taken as the nearest: 0 everywhere if none is finite."""
    nearest = (table == table.min(1, keepdim=True).values) & torch.isfinite(table)
    return nearest.double() / nearest.sum(1, keepdim=True).clamp_min(1)
