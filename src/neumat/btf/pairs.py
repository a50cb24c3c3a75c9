"""Which pairs of directions are captured beside the random ones of a fit: grids, held-out pairs, those of a truth."""

import math

import torch

from neumat.btf.directions import grid, random_directions, rings, spherical
from neumat.seeds import torch_generator

STEEPEST = math.radians(75)  # of held-out directions: the steepest that any measured database has


def grid_pairs(theta, count):
    """Return light and view, each (n^2, 3): every view of a ring grid under every light of it, view by view.

    theta: polar angles of the rings, degrees; count: directions of each.
    """
    directions = rings(theta, count)
    return grid(directions, directions)


def held_out_pairs(n, seed, name):
    """Return light and view, each (n, 3): pairs that no fit sees, up to STEEPEST.

    The views' polar angles are spread evenly, so that every ring of them has its share; all else is random.
    """
    generator = torch_generator(seed, "held-out pairs", name)
    theta = (torch.arange(n) + torch.rand(n, generator=generator)) / n * STEEPEST
    view = spherical(theta, torch.rand(n, generator=generator) * (2 * math.pi))
    return random_directions(n, generator, STEEPEST), view


def given_pairs(pairs):
    """Return light and view, each (n, 3), of rows of four angles: theta and phi of light and view, degrees."""
    theta_light, phi_light, theta_view, phi_view = torch.tensor(pairs, dtype=torch.float32).deg2rad().unbind(-1)
    return spherical(theta_light, phi_light), spherical(theta_view, phi_view)
