"""Fields of blends without a fit: interpolations of the fields of their parents.

All fits start from one field, so that their weights correspond, and an interpolation of weights is a field between.
"""

from itertools import chain, combinations

import torch

from neumat.augment.dense import PARENTS, WEIGHTS, colour_matrices, mix, parents_of
from neumat.brdf.coordinates import grid_angles, half_difference
from neumat.brdf.statistics import valid_entries
from neumat.fields.field import evaluate_inputs
from neumat.fields.layout import matrices

EVERY = 557  # entries of the grid: 2000 directions, of which the shares of the parents are found
AT_ONCE = 64  # bases


def interpolated_fields(rows, fitted, path):
    """Return the weights (n, 675) of the dense bases `rows`: an interpolation of their parents' fields, whose colours
    are mixed and whose brightness is changed in the last layer, which is right to first order in f.

    fitted: the NeuMerl in `path`. A field holds log(1 + f): a base that blends reflectances is not the interpolation at
    its own weights, of which a bright highlight would take nearly all, but at the `shares` that come nearest.
    Raises NeumatError for parents that the store lacks.
    """
    numbers, where = parents_of(rows, fitted.names, path)
    fields = fitted.weights[torch.from_numpy(numbers)]
    entries = valid_entries()[::EVERY]
    inputs = half_difference(*grid_angles(torch.as_tensor(entries)))
    values = evaluate_inputs(fields, inputs.float()).numpy()
    colours = torch.from_numpy(colour_matrices(rows))
    used = torch.from_numpy(rows[WEIGHTS].to_numpy() > 0)
    weight = torch.empty(len(rows), len(PARENTS))
    for start in range(0, len(rows), AT_ONCE):
        part = slice(start, start + AT_ONCE)
        target = torch.from_numpy(mix(values, where[part], rows[part])).log1p()
        terms = torch.from_numpy(values[where[part]]) @ colours[part, None].mT
        weight[part] = shares(terms.log1p().flatten(2), target.flatten(1), used[part])
    blend = (weight[:, :, None] * fields[torch.from_numpy(where)]).sum(1)
    last = matrices(blend)[-1]
    last[:] = last @ colours.mT
    return blend


def shares(terms, target, used):
    """Return the shares (n, k), not negative and with the sum 1, of the terms (n, k, m) whose sum comes nearest to
    target (n, m) by least squares; 0 where not `used` (n, k).

    The least of the solutions without a bound on every subset of the terms that is within the bounds.
    """
    count = terms.shape[1]
    terms, target = terms.double(), target.double()
    gram, product = terms @ terms.mT, (terms @ target[:, :, None])[:, :, 0]
    best, least = terms.new_zeros(len(terms), count), terms.new_full((len(terms),), torch.inf)
    for subset in map(list, chain.from_iterable(combinations(range(count), size) for size in range(1, count + 1))):
        # Lagrange's conditions: the gradient is the same along all terms of the subset, and the shares add to 1.
        system = terms.new_ones(len(terms), len(subset) + 1, len(subset) + 1)
        system[:, -1, -1] = 0
        system[:, :-1, :-1] = gram[:, subset][:, :, subset] + 1e-9 * torch.eye(len(subset))
        right = torch.cat([product[:, subset], product.new_ones(len(terms), 1)], 1)
        found = torch.zeros_like(best)
        found[:, subset] = torch.linalg.solve(system, right)[:, :-1]
        error = (found[:, None] @ gram @ found[:, :, None])[:, 0, 0] - 2 * (found * product).sum(1)
        better = (error < least) & (found >= 0).all(1) & used[:, subset].all(1)
        best[better], least[better] = found[better], error[better]
    return best.float()
