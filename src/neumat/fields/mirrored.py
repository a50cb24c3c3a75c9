"""What fields show in programs that do not fold phi_d to [0, pi), and how sampled fields are mended for them.

Neural-BRDF's plugin (Sztrajman et al. 2021) and others hand a network the difference vector d as it is, which half of
the time is the mirror image (-d_x, -d_y) of the one that is used here. Fits learn both. A sampled field is near to one
that did, but not exactly one: it learns its own values once more, by either image.
"""

import functools

import torch

from neumat.brdf.coordinates import above_horizon, half_difference, rusinkiewicz
from neumat.fields.field import evaluate_inputs
from neumat.fields.fit import FILL, GROUP, Directions, soap, train
from neumat.seeds import torch_generator

LIMIT = 0.1  # largest error of the brightness, over any pairs of directions
SERVED = 0.8 * LIMIT  # the same over the pairs of the check of what is served: over others it is not the same
NONE = 1e-3  # an error below which a field is left as it is
FAR = LIMIT / 2  # an error beyond which a field is trained again
ROUNDS = 3  # of training
EVERY = 97  # a step through the entries above the horizon that no length of the grid's axes divides
TRAINING = {
    "samples": 12_800,
    "batch_size": 128,
    "highlight_share": 0.5,
    "learning_rate": 2e-3,
    "schedule": "cosine",
    "precision": "float32",
}
MIRRORED = 0.5  # share of a batch: the directions drawn by uniform angles
PAIRS = 8192  # of directions, over which brightness is a mean


def unfolded_brightness(weights, name="reciprocity"):
    """Return the brightness (n,), the mean of f cos theta_i, of fields (n, 675) that are evaluated without folding
    phi_d to [0, pi), over the pairs of directions with d_y < 0, as a multiple of what it is with folding: 1 is right.
    name: of the pairs, which are others for another name.
    """
    wi, wo = random_pairs(PAIRS, name)
    inputs, cosine = half_difference(*rusinkiewicz(wi, wo)).to(weights.dtype), wi[:, 2:].to(weights.dtype)
    mirrored = inputs * inputs.new_tensor([1, 1, 1, -1, -1, 1])
    raw, folded = ((evaluate_inputs(weights, x) * cosine).mean((1, 2)) for x in (mirrored, inputs))
    return raw / folded


def unfolded_error(weights, name="reciprocity"):
    """Return how far (n,) the `unfolded_brightness` of fields (n, 675) is off; not a number where that is not one."""
    return (unfolded_brightness(weights, name) - 1).abs()


def mended(weights):
    """Return fields (n, 675) like `weights` (n, 675) that show the same without folding phi_d.

    Each is trained to its own values, with half of the directions mirrored; a training that leaves a larger error of
    the brightness than there was is dropped. Some may still be beyond SERVED, see `fields.validity.valid`. A result
    does not depend on the others, since short groups are filled up.
    """
    result, error = weights.clone(), unfolded_error(weights)
    for round_ in range(ROUNDS):
        wrong = (error > (FAR if round_ else NONE)).nonzero()[:, 0]
        for first in range(0, len(wrong), GROUP):
            rows = wrong[first : first + GROUP]
            trained = _trained(weights[rows], result[rows], f"mended {round_}")
            left = unfolded_error(trained)
            better = left < error[rows]
            result[rows[better]], error[rows[better]] = trained[better], left[better]
    return result


def random_pairs(count, name="reciprocity"):
    """Return `count` random pairs of unit directions above the horizon, (2, count, 3) float64, by `name`."""
    pair = torch.randn(2, count, 3, generator=torch_generator(0, name))
    pair[..., 2].abs_()
    return torch.nn.functional.normalize(pair, dim=2).double()


@functools.cache
def _directions():
    return Directions(above_horizon().nonzero()[::EVERY, 0], 0)


def _trained(wanted, start, seed):
    """Return fields (k, 675), trained from `start` (k, 675) to the folded values of `wanted` (k, 675)."""
    directions = _directions()
    filled = torch.arange(-(-len(start) // FILL) * FILL) % len(start)
    values = evaluate_inputs(wanted, directions.inputs).transpose(0, 1)
    return train(values, directions, start[filled], TRAINING, soap, seed, mirrored=MIRRORED)[: len(start)]
