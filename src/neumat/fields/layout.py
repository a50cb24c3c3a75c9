"""The 675-vector: how the weights of one neural field lie in it.

6-21-21-3 (Sztrajman et al. 2021): W1 (6, 21) row-major with kernels (in, out), b1 (21), W2 (21, 21), b2 (21),
W3 (21, 3), b3 (3). The same order for every width of field that this package fits.
"""

from itertools import pairwise

import torch

from neumat.augment.permutations import channel_order
from neumat.errors import NeumatError

WIDTHS = (6, 21, 21, 3)


def size(widths=WIDTHS):
    """Return the number of weights and biases of a multilayer perceptron of these widths."""
    return sum(a * b + b for a, b in pairwise(widths))


SIZE = size()


def widths_of(count):
    """Return the widths (6, w, w, 3) of the field that has `count` weights; raises NeumatError where none has."""
    for width in range(1, 257):
        if size((WIDTHS[0], width, width, WIDTHS[-1])) == count:
            return WIDTHS[0], width, width, WIDTHS[-1]
    raise NeumatError("weights", f"{SIZE} numbers, or as many as a field of another width has", count)


def unpack(weights, widths=WIDTHS):
    """Return [(W (..., in, out), b (..., out)), ...], views into `weights` (..., size); see `matrices`."""
    return [(matrix[..., :-1, :], matrix[..., -1, :]) for matrix in matrices(weights, widths)]


def matrices(weights, widths=WIDTHS):
    """Return [(..., in + 1, out)], views into `weights` (..., size): each layer's kernel, its bias as the last row.

    Raises NeumatError where the last dimension does not hold these widths.
    """
    if weights.shape[-1] != size(widths):
        raise NeumatError("weights", f"{size(widths)} numbers for widths {widths}", weights.shape[-1])
    layers, at = [], 0
    for a, b in pairwise(widths):
        layers.append(weights[..., at : at + (a + 1) * b].unflatten(-1, (a + 1, b)))
        at += (a + 1) * b
    return layers


def permutation_indices(permutation, widths=WIDTHS):
    """Return the (size,) gather indices that permute a field's colour channels: "gbr" puts G into R's place."""
    order = torch.tensor(channel_order(permutation))
    indices = torch.arange(size(widths))
    kernel, bias = unpack(indices, widths)[-1]
    kernel[:], bias[:] = kernel[:, order].clone(), bias[order].clone()
    return indices


def permute_channels(weights, permutation, widths=WIDTHS):
    """Return the weights (..., size) of the field whose output channels are permuted: exact, no refit."""
    return weights[..., permutation_indices(permutation, widths).to(weights.device)]
