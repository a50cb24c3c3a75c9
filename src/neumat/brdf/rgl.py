"""RGL `.bsdf` files (Dupuy & Jakob 2018), isotropic RGB: read, evaluated, resampled onto the MERL grid.

The file tabulates f cos(theta_o) = rgb(s) ndf(u_m) / (4 sigma(u_i)), where u_m = (sqrt(2 theta_m / pi), phi /
2 pi) is the half vector on the unit square, and s is u_m mapped by the distribution function of the visible
normals `vndf` (marginal in phi, conditional in theta), which stretches the highlight over the table.
"""

import math
import struct
from pathlib import Path

import numpy as np
import torch

from neumat.brdf.coordinates import ENTRIES, above_horizon, directions, grid_angles
from neumat.errors import NeumatError

SUFFIX = ".bsdf"
FIELDS = ("theta_i", "phi_i", "ndf", "sigma", "vndf", "rgb")
MAGIC = b"tensor_file\0\1\0"
DTYPES = dict(enumerate("u1 i1 <u2 <i2 <u4 <i4 <u8 <i8 <f2 <f4 <f8".split(), start=1))


def check_rgl(path):
    """Raise NeumatError where `path` is not a tensor file, version 1.0. Reads the first bytes only."""
    path = Path(path)
    if not path.is_file():
        raise NeumatError(path, "an RGL .bsdf file", "no such file")
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise NeumatError(path, "an RGL .bsdf file (tensor file, version 1.0)", "another kind of file")


def read_tensors(path):
    """Return {name: array} of a tensor file. Raises NeumatError where it is missing or broken."""
    check_rgl(path)
    data = Path(path).read_bytes()
    tensors = {}
    try:
        (count,) = struct.unpack_from("<I", data, len(MAGIC))
        at = len(MAGIC) + 4
        for _ in range(count):
            (length,) = struct.unpack_from("<H", data, at)
            name = data[at + 2 : at + 2 + length].decode()
            at += 2 + length
            dimensions, dtype, offset = struct.unpack_from("<HBQ", data, at)
            shape = struct.unpack_from(f"<{dimensions}Q", data, at + 11)
            at += 11 + 8 * dimensions
            tensors[name] = np.frombuffer(data, DTYPES[dtype], math.prod(shape), offset).reshape(shape)
    except (struct.error, ValueError, KeyError) as error:
        raise NeumatError(path, "a whole tensor file", f"a truncated or damaged one ({error})") from error
    return tensors


class Rgl:
    """An isotropic RGB material of the RGL database, read from a .bsdf file."""

    def __init__(self, path):
        tensors = read_tensors(path)
        for key in FIELDS:
            if key not in tensors:
                raise NeumatError(path, "an RGB file of the RGL database", f"no field {key}")
            if not np.isfinite(tensors[key]).all():
                raise NeumatError(path, f"finite values in field {key}", "NaN or infinite ones")
        if len(tensors["phi_i"]) != 1:
            raise NeumatError(path, "an isotropic material (1 phi_i)", f"{len(tensors['phi_i'])} phi_i")
        fields = {key: torch.from_numpy(tensors[key].astype(np.float64)) for key in FIELDS}
        self.theta_i, self.ndf, self.sigma = fields["theta_i"], fields["ndf"], fields["sigma"]
        self.rgb = fields["rgb"][0].movedim(1, -1)  # (theta_i, y, x, 3)
        # Integrals of the bilinear vndf, trapezoidal and so exact: along x within a row, then over rows.
        vndf = fields["vndf"][0]
        rows = cumulative(vndf)
        marginal = cumulative(rows[..., -1])
        total = marginal[:, -1, None, None]
        self.vndf, self.rows, self.marginal = vndf / total, rows / total, marginal / total[..., 0]

    def reflected(self, wi, wo):
        """Return f cos(theta_o) (n, 3), 1/sr, for unit directions (n, 3) above the horizon (z up)."""
        wi, wo = wi.double(), wo.double()
        m = torch.nn.functional.normalize(wi + wo, dim=-1)
        u_i = _theta_to_unit(wi)
        phi = torch.atan2(m[:, 1], m[:, 0]) - torch.atan2(wi[:, 1], wi[:, 0])
        u_m = _theta_to_unit(m)
        v_m = torch.remainder(phi / (2 * math.pi) + 0.5, 1.0)
        theta_i = torch.acos(wi[:, 2].clamp(-1, 1))
        slices = _brackets(self.theta_i, theta_i)
        x, y = self._warp(u_m, v_m, slices)
        spectrum = sum(w[:, None] * _bilinear(self.rgb, x, y, s) for s, w in slices).clamp_min(0)
        ndf = _bilinear(self.ndf[None], u_m, v_m, 0)
        sigma = _bilinear(self.sigma[None], u_i, torch.full_like(u_i, 0.5), 0)
        return spectrum * (ndf / (4 * sigma))[:, None]

    def _warp(self, u, v, slices):
        """Return the distribution function (x conditional, y marginal), each (n,), of the vndf at (u, v)."""
        i, a = _cell(u, self.vndf.shape[2])
        j, b = _cell(v, self.vndf.shape[1])

        def mix(values):
            return sum(w * values(s) for s, w in slices)

        # The density and its row integrals at the grid points around (u, v).
        left = mix(lambda s: (1 - b) * self.vndf[s, j, i] + b * self.vndf[s, j + 1, i])
        right = mix(lambda s: (1 - b) * self.vndf[s, j, i + 1] + b * self.vndf[s, j + 1, i + 1])
        before = mix(lambda s: (1 - b) * self.rows[s, j, i] + b * self.rows[s, j + 1, i])
        row0, row1 = mix(lambda s: self.rows[s, j, -1]), mix(lambda s: self.rows[s, j + 1, -1])
        below = mix(lambda s: self.marginal[s, j])
        step_x, step_y = 1 / (self.vndf.shape[2] - 1), 1 / (self.vndf.shape[1] - 1)
        whole = (1 - b) * row0 + b * row1
        x = (before + step_x * a * (left + a / 2 * (right - left))) / whole.clamp_min(1e-30)
        y = below + step_y * b * (row0 + b / 2 * (row1 - row0))
        return x.clamp(0, 1), y.clamp(0, 1)


def read_rgl(path):
    """Return an RGL file resampled onto the MERL grid: (1458000, 3) float32, 1/sr, NaN below the horizon.

    A MERL table is reciprocal by construction, the measured file nearly so: each entry is the mean of both
    orders of its two directions, weighted by the cosine that f was divided by, since interpolated values of f
    cos(theta_o) do not vanish exactly at the horizon. Raises NeumatError for a missing, damaged, anisotropic
    or spectral file.
    """
    material = Rgl(path)
    entries = above_horizon().nonzero()[:, 0]
    values = torch.full((ENTRIES, 3), torch.nan)
    for part in entries.split(1 << 17):
        wi, wo = directions(*grid_angles(part))
        both = material.reflected(wi, wo) + material.reflected(wo, wi)
        values[part] = (both / (wi[:, 2:] + wo[:, 2:])).float()
    return values.numpy()


def cumulative(values):
    """Return trapezoidal integrals over the unit interval, from 0, along the last axis (same shape)."""
    steps = 0.5 * (values[..., 1:] + values[..., :-1]) / (values.shape[-1] - 1)
    return torch.nn.functional.pad(steps.cumsum(-1), (1, 0))


def _theta_to_unit(w):
    """Return sqrt(2 theta / pi) of directions (n, 3); the arc form keeps small angles exact."""
    theta = torch.atan2(torch.hypot(w[:, 0], w[:, 1]), w[:, 2])
    return torch.sqrt(theta * (2 / math.pi))


def _cell(u, size):
    """Return (index, fraction) of positions in [0, 1] on a grid of `size` points."""
    position = u.clamp(0, 1) * (size - 1)
    index = position.floor().clamp(max=size - 2).long()
    return index, position - index


def _brackets(axis, x):
    """Return ((lower index, weight), (upper index, weight)) for interpolating x on a sorted axis."""
    lower = (torch.searchsorted(axis, x, right=True) - 1).clamp(0, len(axis) - 2)
    t = ((x - axis[lower]) / (axis[lower + 1] - axis[lower])).clamp(0, 1)
    return (lower, 1 - t), (lower + 1, t)


def _bilinear(values, x, y, s):
    """Return values (slices, ny, nx, ...) of slice s interpolated at x, y in [0, 1]."""
    i, a = _cell(x, values.shape[2])
    j, b = _cell(y, values.shape[1])
    if values.ndim == 4:
        a, b = a[:, None], b[:, None]
    top = (1 - a) * values[s, j, i] + a * values[s, j, i + 1]
    bottom = (1 - a) * values[s, j + 1, i] + a * values[s, j + 1, i + 1]
    return (1 - b) * top + b * bottom
