"""RGL `.bsdf` files (Dupuy & Jakob 2018), isotropic RGB: read, evaluated, resampled onto the MERL grid.

The file tabulates f cos(theta_o) = rgb(s) ndf(u_m) / (4 sigma(u_i)), where u_m = (sqrt(2 theta_m / pi), phi /
2 pi) is the half vector on the unit square, and s is u_m mapped by the distribution function of the visible
normals `vndf` (marginal in phi, conditional in theta), which stretches the highlight over the table. Where its
`jacobian` is 0, rgb(s) is f cos(theta_o) itself. What is read, and as what, is what Mitsuba's plugin `measured` reads
in its RGB variants, but for anisotropic materials (more than 2 phi_i): nothing here can hold them.
"""

import math
import struct
from pathlib import Path

import numpy as np
import torch

from neumat.brdf.coordinates import ENTRIES, above_horizon, directions, grid_angles
from neumat.brdf.table import checked
from neumat.errors import NeumatError
from neumat.files import reading

SUFFIX = ".bsdf"
# Type and shape of each field; letters are sizes.
FIELDS = {
    "description": ("u1", ("d",)),
    "phi_i": ("<f4", ("p",)),
    "theta_i": ("<f4", ("t",)),
    "ndf": ("<f4", ("a", "b")),
    "sigma": ("<f4", ("e", "f")),
    "vndf": ("<f4", ("p", "t", "y", "x")),
    "luminance": ("<f4", ("p", "t", "n", "n")),
    "rgb": ("<f4", ("p", "t", 3, "n", "n")),
    "jacobian": ("u1", (1,)),
}
MAGIC = b"tensor_file\0\1\0"
DTYPES = dict(enumerate("u1 i1 <u2 <i2 <u4 <i4 <u8 <i8 <f2 <f4 <f8".split(), start=1))


def check_rgl(path):
    """Raise NeumatError where `path` is not a tensor file, version 1.0. Reads the first bytes only."""
    with reading(path, "an RGL .bsdf file"), Path(path).open("rb") as file:
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
    except (struct.error, ValueError, KeyError, OverflowError) as error:
        raise NeumatError(path, "a whole tensor file", f"a truncated or damaged one ({error})") from error
    return tensors


class Rgl:
    """An isotropic RGB material of the RGL database, read from a .bsdf file."""

    def __init__(self, path):
        tensors = read_tensors(path)
        check_fields(path, tensors)
        fields = {key: torch.from_numpy(tensors[key].astype(np.float64)) for key in FIELDS}
        self.phi_i, self.theta_i = fields["phi_i"], fields["theta_i"]
        self.ndf, self.sigma, self.jacobian = fields["ndf"], fields["sigma"], fields["jacobian"].item() != 0
        # Slices, for each phi_i and theta_i in turn: (slices, y, x, 3) and (slices, y, x).
        self.rgb, vndf = fields["rgb"].flatten(0, 1).movedim(1, -1), fields["vndf"].flatten(0, 1)
        # Integrals of the bilinear vndf, trapezoidal and so exact: along x within a row, then over rows.
        rows = cumulative(vndf)
        marginal = cumulative(rows[..., -1])
        total = marginal[:, -1, None, None]
        self.vndf, self.rows, self.marginal = vndf / total, rows / total, marginal / total[..., 0]

    def reflected(self, wi, wo):
        """Return f cos(theta_o) (n, 3), 1/sr, for unit directions (n, 3) above the horizon (z up)."""
        wi, wo = wi.double(), wo.double()
        m = torch.nn.functional.normalize(wi + wo, dim=-1)
        phi_i = torch.atan2(wi[:, 1], wi[:, 0])
        u_i, v_i = _theta_to_unit(wi), phi_i / (2 * math.pi) + 0.5
        u_m = _theta_to_unit(m)
        v_m = torch.remainder((torch.atan2(m[:, 1], m[:, 0]) - phi_i) / (2 * math.pi) + 0.5, 1.0)
        theta_i = torch.acos(wi[:, 2].clamp(-1, 1))
        slices = [
            (p * len(self.theta_i) + t, share_p * share_t)
            for p, share_p in _brackets(self.phi_i, phi_i)
            for t, share_t in _brackets(self.theta_i, theta_i)
        ]
        x, y = self._warp(u_m, v_m, slices)
        spectrum = sum(w[:, None] * _bilinear(self.rgb, x, y, s) for s, w in slices).clamp_min(0)
        if not self.jacobian:
            return spectrum
        ndf = _bilinear(self.ndf[None], u_m, v_m, 0)
        sigma = _bilinear(self.sigma[None], u_i, v_i, 0)
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
    or spectral file, and where `table.checked` does.
    """
    material = Rgl(path)
    entries = above_horizon().nonzero()[:, 0]
    values = torch.full((ENTRIES, 3), torch.nan)
    for part in entries.split(1 << 17):
        wi, wo = directions(*grid_angles(part))
        both = material.reflected(wi, wo) + material.reflected(wo, wi)
        values[part] = (both / (wi[:, 2:] + wo[:, 2:])).float()
    return checked(path, values.numpy())


def check_fields(path, tensors):
    """Raise NeumatError where the tensors {name: array} are not those of an isotropic RGB material.

    That is: FIELDS, without those of spectral files; finite values; tables of at least 2 points a side; a vndf that is
    a density; 1 or 2 phi_i, which like theta_i rise.
    """
    if "spectra" in tensors or "wavelengths" in tensors:
        raise NeumatError(path, "an RGB file of the RGL database (*_rgb.bsdf)", "a spectral one")
    sizes = {}
    for key, (dtype, shape) in FIELDS.items():
        if key not in tensors:
            raise NeumatError(path, "an RGB file of the RGL database", f"no field {key}")
        array = tensors[key]
        expected = shape
        if len(shape) == array.ndim:
            pairs = zip(shape, array.shape, strict=True)
            expected = tuple(sizes.setdefault(n, m) if isinstance(n, str) else n for n, m in pairs)
        if array.dtype != dtype or array.shape != expected:
            wanted = f"{np.dtype(dtype)} of shape ({', '.join(map(str, expected))}) in field {key}"
            raise NeumatError(path, wanted, f"{array.dtype} of shape {array.shape}")
        if not np.isfinite(array).all():
            raise NeumatError(path, f"finite values in field {key}", "NaN or infinite ones")
        if array.ndim > 1 and min(array.shape[-2:]) < 2:
            raise NeumatError(path, f"at least 2 points a side in field {key}", array.shape)
    if (tensors["vndf"] < 0).any() or not tensors["vndf"].any((2, 3)).all():
        raise NeumatError(path, "densities in field vndf", "negative ones, or 0 everywhere")
    if sizes["p"] > 2:
        raise NeumatError(path, "an isotropic material (1 or 2 phi_i)", f"{sizes['p']} phi_i")
    for key in ("phi_i", "theta_i"):
        if not len(tensors[key]) or (np.diff(tensors[key]) <= 0).any():
            raise NeumatError(path, f"rising angles in field {key}", tensors[key])


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
    """Return ((lower index, weight), (upper index, weight)) for interpolating x on a sorted axis; one of length 1 has
    no upper one."""
    if len(axis) == 1:
        return ((torch.zeros_like(x, dtype=torch.long), torch.ones_like(x)),)
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
