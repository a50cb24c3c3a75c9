"""Fields as MERL `.binary` files: 35 MB whatever the material."""

import torch

from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles
from neumat.brdf.merl import write_merl
from neumat.export.values import finite_values


def write_field(path, weights, metadata):
    """Write the field (675,) on the MERL grid; entries below the horizon are invalid.

    The format has no metadata. Raises NeumatError for a field that is infinite anywhere.
    """
    valid = above_horizon()
    values = torch.full((ENTRIES, 3), torch.nan)
    values[valid] = finite_values(weights, grid_angles(valid.nonzero()[:, 0]), metadata["name"])
    write_merl(path, values.numpy())
