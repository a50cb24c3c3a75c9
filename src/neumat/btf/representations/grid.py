"""Tables over a grid of views and lights, and interpolation between their entries."""

import numpy as np
import torch
from scipy.spatial import Delaunay, QhullError

from neumat.errors import NeumatError

SAME = 1e-3  # directions nearer than this are one


def regular_grid(store, method):
    """Return (views (V, 3), lights (L, 3), sweeps (V, L)) of a BtfStore of pictures: which picture shows which pair.

    Raises NeumatError, with the name of the `method`, where the store has no pictures, or not every view under every
    light exactly once.
    """
    if store.kind != "pictures":
        raise NeumatError(method, "a store of pictures for every pair of views and lights", f"one of {store.kind}")
    views, of_view = _distinct(store.view[:, 0])
    lights, of_light = _distinct(store.light[:, 0])
    number = of_view * len(lights) + of_light
    found = len(views) * len(lights)
    if len(number) != found or len(number.unique()) != found:
        expected = f"every view under every light once, {len(views)} x {len(lights)} pictures"
        raise NeumatError(method, expected, f"{len(number.unique())} pairs in {len(number)} pictures")
    return views, lights, number.argsort().view(len(views), len(lights))


def _distinct(directions):
    """Return the distinct ones (m, 3) of directions (n, 3), in order of rounded coordinates, and which each is (n,)."""
    _, which = torch.unique((directions / SAME).round(), dim=0, return_inverse=True)
    distinct = directions.new_empty(which.max() + 1, 3)
    distinct[which] = directions
    return distinct, which


class Triangles:
    """Interpolation between directions: barycentric in the Delaunay triangulation of the disk of radius theta.

    Directions outside the triangulation take the nearest point of its border. Raises NeumatError for directions that
    span no triangle.
    """

    def __init__(self, directions):
        try:
            self.mesh = Delaunay(_disk(directions))
        except (QhullError, ValueError) as error:
            raise NeumatError("directions", "at least three that are not in a line", len(directions)) from error

    def __call__(self, directions):
        """Return (index int64 (n, 3), weight (n, 3)) of directions (n, 3); weights are 0..1 and sum to 1."""
        mesh, place = self.mesh, _disk(directions)
        triangle = mesh.find_simplex(place)
        outside = triangle < 0
        index = mesh.simplices[triangle].astype(np.int64)
        linear = mesh.transform[triangle]
        weight = np.einsum("nij,nj->ni", linear[:, :2], place - linear[:, 2])
        weight = np.concatenate([weight, 1 - weight.sum(1, keepdims=True)], 1).clip(0, 1)
        if outside.any():
            start, end = mesh.points[mesh.convex_hull].transpose(1, 0, 2)
            edge = end - start
            along = (((place[outside, None] - start) * edge).sum(2) / (edge**2).sum(1)).clip(0, 1)
            nearest = ((start + along[..., None] * edge - place[outside, None]) ** 2).sum(2).argmin(1)
            along = along[np.arange(len(nearest)), nearest]
            index[outside, :2], index[outside, 2] = mesh.convex_hull[nearest], mesh.convex_hull[nearest, 0]
            weight[outside] = np.stack([1 - along, along, np.zeros_like(along)], 1)
        return torch.from_numpy(index), torch.from_numpy(weight / weight.sum(1, keepdims=True)).float()


def _disk(directions):
    """Return the points (n, 2), float64 array, at radius theta and azimuth phi of directions (n, 3)."""
    x, y, z = directions.double().numpy().T
    side = np.hypot(x, y)
    scale = np.arctan2(side, z) / np.maximum(side, 1e-12)
    return np.stack([x * scale, y * scale], 1)
