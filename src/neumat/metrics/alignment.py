"""How near samples come to what an image asked for, and how much those of one condition differ among themselves."""

import functools

import numpy as np
import torch

from neumat.errors import NeumatError
from neumat.metrics.distances import Comparison, distance_tables
from neumat.metrics.pictures import compare_pictures
from neumat.render.scene import Light, environment
from neumat.render.sphere import render_fields

# Other directions, sizes and strengths than the scene in which conditions are rendered: what a sample has only learnt
# to look like there shows here. Achromatic and smooth as those are.
NEW_LIGHTS = (
    Light((0.70, 0.50, 0.55), 0.22, 7.0),  # key, small, upper right
    Light((-0.60, 0.05, 0.70), 0.55, 0.9),  # fill, large, left
    Light((-0.10, -0.75, 0.55), 0.30, 1.2),  # from below
    Light((0.75, -0.15, -0.60), 0.30, 3.0),  # rim, behind right
    Light((-0.45, 0.85, -0.15), 0.25, 3.0),  # top left
)
new_environment = functools.partial(environment, lights=NEW_LIGHTS)


def rendered_distance(frozen, weights, targets):
    """Return (rmse, psnr), each float64 (n,), of the pictures of fields (n, 675) and of their targets.

    frozen: a FrozenSphere with `new_environment`. targets: fields (n, 675), or pictures uint8 (n, size, size, 3) of
    that sphere. RMSE of values in 0..1; PSNR in dB, capped for equal pictures as `compare_pictures` says.
    Raises NeumatError where the targets don't match the samples.
    """
    found = render_fields(frozen, weights)
    expected = targets if targets.dtype == torch.uint8 else render_fields(frozen, targets)
    if expected.shape != found.shape:
        raise NeumatError("targets", f"{tuple(found.shape)}, one for each sample", tuple(expected.shape))
    squared = (expected.double() - found.double()).flatten(1).square().mean(1)
    return (squared.sqrt() / 255).numpy(), compare_pictures(expected, found)[0]


def diversity(materials):
    """Return the mean distance of every two different materials of a MaterialSet: mean |log(1 + f) - log(1 + f')|.

    Of the materials that are finite; NaN for fewer than two of these.
    """
    everything = slice(0, len(materials))
    (table,) = distance_tables("brdf_l1_log", Comparison(materials, [(everything, everything)]))
    pairs = table[*np.triu_indices(len(materials), 1)]
    return pairs[torch.isfinite(pairs)].mean().item()
