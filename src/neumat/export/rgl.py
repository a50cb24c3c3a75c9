"""RGL-style `.bsdf` files (Dupuy & Jakob 2018): rendered by Mitsuba's own plugin `measured`, in RGB variants.

The file tabulates rgb = 4 f cos(theta_o) over theta_i and the half vector (theta_m, phi_m), the latter on the unit
square: u = sqrt(2 theta_m / pi), v = (phi_m - phi_i + pi) / 2 pi. As in the database's files, `vndf` stretches u so
that most grid points lie in the highlight; it is the same for all theta_i here. `ndf` and `sigma`, by which they
divide, are the constant 1. `luminance` is the density from which directions are drawn.
"""

import math
import struct

import numpy as np
import torch

from neumat.brdf.coordinates import rusinkiewicz
from neumat.brdf.rgl import DTYPES, MAGIC, cumulative
from neumat.export.values import finite_values
from neumat.files import atomic_path

# Grid points over theta_i, and along each axis of the unit square: 3.2 MB a file. With 32 angles dark mirrors come out
# 0.5 % too bright.
THETA_I, SIDE = 48, 64
STRETCH = 256  # grid points of the stretching along u
EVEN = 0.5  # share of the grid points that are spread evenly, without regard to the highlight
ALIGNMENT = 8  # bytes: of each tensor's start


def write_rgl(path, weights, metadata):
    """Write the field (675,) as an isotropic RGB tensor file, with the metadata's name as its description.

    Raises NeumatError for a field that is infinite anywhere.
    """

    def f(*angles):
        return finite_values(weights, angles, metadata["name"])

    theta_i = torch.linspace(0, math.pi / 2, THETA_I, dtype=torch.float64)
    axis = torch.linspace(0, 1, SIDE, dtype=torch.float64)  # of v, and of u once it is stretched
    reflected, area = _tables(f, theta_i, axis, torch.linspace(0, 1, STRETCH, dtype=torch.float64))
    stretch = _stretch((reflected.mean(-1) * area).mean((0, 1)))
    reflected, area = _tables(f, theta_i, axis, *_stretched(stretch, axis))
    reflected *= _brightness(f, theta_i, axis, stretch, reflected)
    density = reflected.mean(-1) * area
    tensors = {
        "description": np.frombuffer(metadata["name"].encode(), np.uint8),
        "phi_i": np.zeros(1, np.float32),
        "theta_i": theta_i,
        "ndf": np.ones((2, 2)),
        "sigma": np.ones((2, 2)),
        "vndf": stretch.expand(1, THETA_I, 2, -1),
        "luminance": density[None],
        "rgb": 4 * reflected.movedim(-1, 1)[None],
        "jacobian": np.ones(1, np.uint8),
    }
    write_tensors(path, {name: _plain(tensor) for name, tensor in tensors.items()})


def _plain(tensor):
    """Return bytes as they are, everything else as float32."""
    array = np.asarray(tensor)
    return array if array.dtype == np.uint8 else array.astype(np.float32)


def _stretch(energy):
    """Return the density of grid points (STRETCH,) along u, with mean 1, for the reflected light (STRETCH,) there."""
    density = EVEN + (1 - EVEN) * energy / energy.mean().clamp_min(1e-30)
    return density / cumulative(density)[-1]


def _stretched(stretch, x):
    """Return u (n,) at the stretched coordinates x (n,), where the integral of `stretch` is x, and du / dx (n,)."""
    nodes = np.linspace(0, 1, STRETCH)
    fine = np.linspace(0, 1, 64 * (STRETCH - 1) + 1)  # between nodes `stretch` is a straight line
    integral = cumulative(torch.from_numpy(np.interp(fine, nodes, stretch)))
    u = np.interp(x, integral, fine)
    return torch.from_numpy(u), torch.from_numpy(1 / np.interp(u, nodes, stretch))


def _brightness(f, theta_i, axis, stretch, reflected):
    """Return factors (n, 1, 1, 3) by which the table, interpolated, reflects as much light as the field f.

    Straight lines between the points of a convex highlight, and across the horizon, lie above the field.
    """
    exact, area = _tables(f, theta_i, _quarters(axis), *_stretched(stretch, _quarters(axis)))
    between = _between(_between(reflected, 1), 2)
    light, found = ((values * area[..., None]).sum((1, 2), True) for values in (exact, between))
    return light / found.clamp_min(1e-30)


def _quarters(axis):
    """Return the points at a quarter and at three quarters of each interval of `axis` (n,): (2 n - 2,)."""
    return torch.stack([axis[:-1] + share * torch.diff(axis) for share in (0.25, 0.75)], 1).flatten()


def _between(values, dim):
    """Return `values` interpolated at `_quarters` of the dimension `dim`."""
    low, high = values.narrow(dim, 0, values.shape[dim] - 1), values.narrow(dim, 1, values.shape[dim] - 1)
    return torch.stack([low + share * (high - low) for share in (0.25, 0.75)], dim + 1).flatten(dim, dim + 1)


def _tables(f, theta_i, v, u, scale=1.0):
    """Return f cos(theta_o) at all theta_i (n,), v (k,), u (m,): (n, k, m, 3); and `scale` dw_o / (du dv), (n, k, m).

    Both are 0 where the direction is below the horizon. f: theta_h, theta_d, phi_d -> (n, 3); scale: (m,), or a number.
    """
    # At 90 degrees the view is not above the horizon; a little less gives the limit.
    theta_i, v, u = torch.meshgrid(theta_i.clamp_max(math.pi / 2 - 1e-4), v, u, indexing="ij")
    theta_m, phi_m = u**2 * (math.pi / 2), (2 * v - 1) * math.pi
    sin_m = torch.sin(theta_m)
    m = torch.stack([sin_m * torch.cos(phi_m), sin_m * torch.sin(phi_m), torch.cos(theta_m)], -1)
    wi = torch.stack([torch.sin(theta_i), torch.zeros_like(theta_i), torch.cos(theta_i)], -1)
    cos_d = (wi * m).sum(-1)
    wo = 2 * cos_d[..., None] * m - wi
    # No direction has a half vector that is turned away from the other one.
    above = (cos_d > 0) & (wo[..., 2] > 0)
    angles = (angle.flatten().float() for angle in rusinkiewicz(wi, wo))
    # dw_o = 4 (w_i . m) dm, and dm = 2 pi^2 u sin(theta_m) du dv.
    area = 8 * math.pi**2 * cos_d * u * sin_m
    return f(*angles).double().view(*u.shape, 3) * (wo[..., 2] * above)[..., None], area * above * scale


def write_tensors(path, tensors):
    """Write {name: array} as a tensor file, version 1.0: a header of names, types, shapes and offsets, then data."""
    codes = {np.dtype(name): code for code, name in DTYPES.items()}
    names = {name: name.encode() for name in tensors}
    at = len(MAGIC) + 4 + sum(2 + len(names[name]) + 11 + 8 * array.ndim for name, array in tensors.items())
    header, data = MAGIC + struct.pack("<I", len(tensors)), b""
    for name, array in tensors.items():
        data += bytes(-(at + len(data)) % ALIGNMENT)
        header += struct.pack("<H", len(names[name])) + names[name]
        header += struct.pack("<HBQ", array.ndim, codes[array.dtype], at + len(data))
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        data += np.ascontiguousarray(array).tobytes()
    with atomic_path(path) as temporary:
        temporary.write_bytes(header + data)
