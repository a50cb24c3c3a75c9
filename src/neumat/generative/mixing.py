"""Materials between the measured ones, drawn anew for every step of a training.

All fits start from one field, so that an interpolation of weights is a material between two; and the last layer of a
field is linear in log(1 + f), so that a factor of that layer raises 1 + f to a power: a material of another brightness
and another contrast. Neither needs a fit, and both are linear: they are the same in any coordinates of the weights.
"""

import torch

from neumat.fields.layout import matrices


def last_layer(weights):
    """Return the fields (n, 675) with all weights but those of the last layer set to 0."""
    last = torch.zeros_like(weights)
    matrices(last)[-1].copy_(matrices(weights)[-1])
    return last


def mixtures(fields, last, n, spread, generator):
    """Return n interpolations (n, k) of two of `fields` (m, k) at a uniform share, whose 1 + f is raised to a power of
    which ln is normal with the standard deviation `spread`.

    last: (m, k), the part of `fields` that is due to `last_layer`. Both are weights, or coordinates of them.
    """
    first, second = torch.randint(len(fields), (2, n), generator=generator)
    share = torch.rand(n, 1, generator=generator)
    power = (spread * torch.randn(n, 1, generator=generator)).exp()
    mixed, of_last = (torch.lerp(x[first], x[second], share) for x in (fields, last))
    return mixed + (power - 1) * of_last
