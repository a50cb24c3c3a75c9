"""Procedural meshes: parametric surfaces with exact texture coordinates and smooth normals.

World frame: y is up; every shape stands on the plane y = 0 with its axis on the y-axis, and is about 2 wide.
"""

from dataclasses import dataclass

import numpy as np

from neumat.errors import NeumatError


@dataclass(frozen=True)
class Mesh:
    """vertices (v, 3), normals (v, 3), uv (v, 2), float32; faces (f, 3), uint32, counterclockwise seen from outside."""

    vertices: np.ndarray
    normals: np.ndarray
    uv: np.ndarray
    faces: np.ndarray


def plane(resolution=1):
    """A floor to the horizon, 1000 wide: no curvature. A texture that repeats once is 2 wide."""
    return _surface(lambda u, v: (1000 * (u - 0.5), 0 * u, 1000 * (v - 0.5)), resolution, resolution, 500)


def sphere(resolution=96):
    """A ball: the same curvature everywhere."""

    def point(u, v):
        azimuth, polar = 2 * np.pi * u, np.pi * v
        return np.sin(polar) * np.sin(azimuth), 1 + np.cos(polar), np.sin(polar) * np.cos(azimuth)

    return _surface(point, 2 * resolution, resolution, closed=(True, False))


def cube(resolution=96):
    """A cube with round edges, a superellipsoid: flat faces, tight curves between."""

    def power(x):
        x = np.round(x, 12)  # a sine of pi isn't 0, and its power would leave a crack along the seam
        return np.sign(x) * np.abs(x) ** 0.22

    def point(u, v):
        azimuth, latitude = 2 * np.pi * _even(u, 4), np.pi * (0.5 - _even(v, 2))
        width = power(np.cos(latitude))
        x, z = width * power(np.sin(azimuth)), width * power(np.cos(azimuth))
        return 0.8 * x, 0.8 * (1 + power(np.sin(latitude))), 0.8 * z

    return _surface(point, 4 * resolution, 2 * resolution, closed=(True, False))


def vase(resolution=96):
    """A turned vase with a wall: convex belly, concave neck, a lip; the inside shows where it is looked into."""
    height, wall = 2.1, 0.035
    # Heights along the profile, from the middle of the inside up to the lip and down the outside; and the side.
    knots = np.array([0.0, 0.04, 0.45, 0.5, 0.55, 0.96, 1.0])

    def point(u, v):
        h = np.interp(v, knots, [0.1, 0.1, 1.0, 1.02, 1.0, 0.0, 0.0])
        side = np.interp(v, knots, [-1, -1, -1, 0, 1, 1, 1])
        filled = np.interp(v, knots, [0, 1, 1, 1, 1, 1, 0])
        belly = 0.3 + 0.48 * np.sin(np.pi * np.clip(h, 0, 1) ** 0.8) ** 1.6
        radius = filled * (belly + 0.14 * np.exp(-(((h - 1) / 0.09) ** 2)) + wall * side)
        azimuth = 2 * np.pi * u
        return radius * np.sin(azimuth), height * h, radius * np.cos(azimuth)

    return _surface(point, 2 * resolution, 4 * resolution, closed=(True, False))


def knot(resolution=96):
    """A tube along a trefoil knot: saddles, and reflections of itself."""

    def point(u, v):
        centre, aside, up = _trefoil(2 * np.pi * v)
        angle = 2 * np.pi * u
        ring = np.cos(angle) * aside + np.sin(angle) * up
        x, y, z = 0.36 * centre + 0.27 * ring
        return x, y + 1.35, z

    return _surface(point, resolution // 2, 6 * resolution, closed=(True, True))


def drape(resolution=128):
    """A hanging sheet: folds, steep above and shallow below."""

    def point(u, v):
        fold = 0.16 * np.sin(5.5 * np.pi * u + 0.6 * np.sin(3 * v)) + 0.05 * np.sin(13 * np.pi * u + 4 * v)
        return 2.2 * (u - 0.5), 2.2 * (1 - v), fold * (0.35 + v)

    return _surface(point, 2 * resolution, resolution)


def cloth(resolution=192):
    """A square sheet over a ball: a dome, then folds down to the floor, on which its corners lie."""
    radius, half = 0.8, 1.85

    def point(u, v):
        x, z = half * (2 * u - 1), half * (2 * v - 1)
        along, azimuth = np.hypot(x, z), np.arctan2(z, x)
        polar = np.minimum(along / radius, np.pi / 2)
        drop = np.maximum(along - radius * np.pi / 2, 0)
        hanging = -np.logaddexp(-10 * drop, -10 * (radius - 0.06)) / 10 + np.logaddexp(0, -10 * (radius - 0.06)) / 10
        fold = 0.13 * np.sin(8 * azimuth) * np.tanh(1.5 * drop**1.5)
        side = radius * np.sin(polar) * (1 + 0.25 * hanging**2) + fold + (drop - hanging)
        return side * np.cos(azimuth), radius * (1 + np.cos(polar)) - hanging - 0.03, side * np.sin(azimuth)

    return _surface(point, resolution, resolution)


def cushion(resolution=128):
    """The upper side of a pillow with four corners: taut at the seams, round in the middle."""

    def point(u, v):
        x, z = 2 * u - 1, 2 * v - 1
        bulge = ((1 - x**4) * (1 - z**4)).clip(0) ** 0.62
        taut = 1 - 0.12 * (1 - x**2) * z**4 - 0.12 * (1 - z**2) * x**4
        crease = 0.02 * np.sin(9 * np.arctan2(z, x)) * np.hypot(x, z) ** 3 * bulge
        return x * taut, 0.02 + 0.6 * bulge + crease, z * taut

    return _surface(point, resolution, resolution)


OPEN = ("drape", "cloth", "cushion")  # shapes that show their back
SHAPES = {shape.__name__: shape for shape in (plane, sphere, cube, vase, knot, drape, cloth, cushion)}


def mesh(name):
    """Return the Mesh of a name in SHAPES; raises NeumatError for another."""
    if name not in SHAPES:
        raise NeumatError("shape", f"one of {', '.join(SHAPES)}", repr(name))
    return SHAPES[name]()


def _surface(point, columns, rows, repeat=1, closed=(False, False)):
    """Return the Mesh of point(u, v) -> (x, y, z) over the unit square; `repeat` scales the texture coordinates.

    Normals are the vertices' mean of those of the adjacent faces, weighted by area; along a seam (closed in u, v)
    those of both sides.
    """
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    vertices = np.stack(np.broadcast_arrays(*point(u, v)), -1)
    index = np.arange(u.size).reshape(u.shape)
    corners = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack([corners[k].ravel() for k in part], 1) for part in ((0, 1, 2), (0, 2, 3))])
    flat = vertices.reshape(-1, 3)
    a, b, c = (flat[faces[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    normals = np.zeros_like(flat)
    for k in range(3):
        np.add.at(normals, faces[:, k], area)
    normals = normals.reshape(vertices.shape)
    if closed[0]:
        normals[:, 0] = normals[:, -1] = normals[:, 0] + normals[:, -1]
    if closed[1]:
        normals[0] = normals[-1] = normals[0] + normals[-1]
    for row in (0, -1):  # a pole: one point, one normal
        if np.ptp(vertices[row], 0).max() < 1e-9:
            normals[row] = normals[row].sum(0)
    normals = normals.reshape(-1, 3)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    faces = faces[np.linalg.norm(area, axis=1) > 1e-12]  # without those that a pole makes flat
    uv = repeat * np.stack([u, 1 - v], -1).reshape(-1, 2)
    return Mesh(*(array.astype(np.float32) for array in (flat, normals, uv)), faces.astype(np.uint32))


def _even(t, quarters):
    """Return t in 0..1 moved so that a superellipse's vertices crowd less at its faces' middles."""
    part, whole = np.modf(t * quarters)
    x = 2 * part - 1
    return (whole + 0.5 + 0.5 * np.sign(x) * np.abs(x) ** 0.6) / quarters


def _trefoil(t):
    """Return the knot's centre line (3, ...) and two unit normals of it."""
    centre = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -1.4 * np.sin(3 * t)])
    along = np.stack([np.cos(t) + 4 * np.cos(2 * t), -np.sin(t) + 4 * np.sin(2 * t), -4.2 * np.cos(3 * t)])
    along = along / np.linalg.norm(along, axis=0)
    aside = np.cross(along, [0, 0, 1], axisa=0)
    aside = np.moveaxis(aside / np.linalg.norm(aside, axis=-1, keepdims=True), -1, 0)
    return centre, aside, np.cross(aside, along, axis=0)
