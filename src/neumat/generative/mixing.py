"""Materials between the training materials, drawn anew for every step of a training.

All fits start from one field, so that an interpolation of weights is a material between two; and the last layer of a
field is linear in log(1 + f), so that a factor of that layer raises 1 + f to a power: a material of another brightness
and another contrast. Neither needs a fit.
"""

import torch

from neumat.fields.layout import matrices


def mixtures(weights, n, generator, spread):
    """Return n fields (n, 675): interpolations of two of `weights` (m, 675) at a uniform share, whose 1 + f is raised
    to a power of which ln is normal with the standard deviation `spread`."""
    first, second = torch.randint(len(weights), (2, n), generator=generator)
    mixed = torch.lerp(weights[first], weights[second], torch.rand(n, 1, generator=generator))
    matrices(mixed)[-1].mul_((spread * torch.randn(n, 1, 1, generator=generator)).exp())
    return mixed
