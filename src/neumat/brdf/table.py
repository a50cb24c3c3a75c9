"""A tabulated material on the MERL grid."""

import math

import numpy as np
import torch

from neumat.brdf.coordinates import ENTRIES, GRID, above_horizon, canonical_phi_d, cosines
from neumat.errors import NeumatError

LEAST_VALID = 0.5  # of the entries above the horizon, in a file


def valid_entries(values):
    """Return which entries of a table (1458000, 3) on the MERL grid are reflectances, bool (1458000,): those above the
    horizon whose values are all finite and not negative. Array or tensor, like `values`.

    The one place that decides it: files differ in what they hold where nothing was measured.
    """
    if torch.is_tensor(values):
        return above_horizon() & (torch.isfinite(values) & (values >= 0)).all(1)
    return valid_entries(torch.from_numpy(values)).numpy()


def checked(path, values):
    """Return the table (1458000, 3), an array, that a file holds, NaN where it is not valid.

    Raises NeumatError where fewer than LEAST_VALID of the entries above the horizon are valid.
    """
    valid = valid_entries(values)
    share = valid.sum() / above_horizon().sum().item()
    if share < LEAST_VALID:
        expected = f"finite values, none negative, in at least {LEAST_VALID:.0%} of the entries above the horizon"
        raise NeumatError(path, expected, f"{share:.1%}")
    values[~valid] = np.nan
    return values


class Table:
    """A material given by its values (1458000, 3), 1/sr, on the MERL grid; those of `valid_entries` count."""

    def __init__(self, values):
        values = torch.as_tensor(values, dtype=torch.float32)
        if values.shape != (ENTRIES, 3):
            raise ValueError(f"expected values of shape {(ENTRIES, 3)}; found {tuple(values.shape)}")
        self.valid = valid_entries(values)
        self.values = torch.where(self.valid[:, None], values, 0.0)

    def eval(self, theta_h, theta_d, phi_d):
        """Return BRDF values (n, 3), 1/sr, at angles (n,): trilinear over the valid corners of the grid cell.

        Weights are renormalised where corners are invalid; 0 where none is valid and below the horizon.
        """
        n_h, n_d, n_p = GRID
        # Positions in grid units; beyond the last theta the last entry holds, phi_d wraps (f has period pi).
        h = (torch.sqrt(theta_h / (math.pi / 2)) * n_h).clamp(0, n_h - 1)
        d = (theta_d / (math.pi / 2) * n_d).clamp(0, n_d - 1)
        p = canonical_phi_d(phi_d) / math.pi * n_p
        h0, d0, p0 = h.floor().long(), d.floor().long(), p.floor().long()
        total = torch.zeros(len(theta_h), 3)
        weights = torch.zeros(len(theta_h), 1)
        for corner in range(8):
            i, j, k = corner >> 2, corner >> 1 & 1, corner & 1
            weight = (1 - (h - h0 - i).abs()) * (1 - (d - d0 - j).abs()) * (1 - (p - p0 - k).abs())
            index = (h0 + i).clamp(max=n_h - 1) * n_d + (d0 + j).clamp(max=n_d - 1)
            index = index * n_p + (p0 + k) % n_p
            weight = (weight * self.valid[index])[:, None]
            total += weight * self.values[index]
            weights += weight
        cos_i, cos_o = cosines(theta_h, theta_d, phi_d)
        lit = ((cos_i > 0) & (cos_o > 0))[:, None] & (weights > 1e-6)
        return torch.where(lit, total / weights.clamp_min(1e-6), 0.0)
