"""The values that tables are made of."""

import torch

from neumat.errors import NeumatError
from neumat.fields.field import evaluate


def finite_values(weights, angles, name):
    """Return f (n, 3), 1/sr, of the field (675,) at `angles` (theta_h, theta_d, phi_d), each (n,); 0 below the horizon.

    Raises NeumatError where the exponential overflows: a table can't hold infinity.
    """
    values = evaluate(weights[None], *angles)[0]
    if not torch.isfinite(values).all():
        raise NeumatError(name, "a field with finite values", "infinite ones")
    return values
