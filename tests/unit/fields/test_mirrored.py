import math

import pytest
import torch

from neumat.brdf.analytic import GGX
from neumat.brdf.coordinates import above_horizon, cosines, grid_angles, half_difference
from neumat.fields.field import evaluate_inputs
from neumat.fields.fit import Directions, random_weights, soap, train
from neumat.fields.layout import SIZE, WIDTHS
from neumat.fields.mirrored import LIMIT, TRAINING, mended, unfolded_brightness, unfolded_error
from neumat.seeds import torch_generator

MIRROR = torch.tensor([1, 1, 1, -1, -1, 1])


def seen(weights, signs=1):
    """log(1 + f cos theta_i) of fields (n, 675) on the grid, at d or at its mirror image."""
    angles = grid_angles(above_horizon().nonzero()[::1999, 0])
    return (evaluate_inputs(weights, half_difference(*angles) * signs) * cosines(*angles)[0][:, None]).log1p()


def perturbed(weights, deviation=0.02):
    """Fields that are no longer the same by d and its mirror image, as samples are not."""
    return weights + deviation * torch.randn(weights.shape, generator=torch_generator(0, "perturbed"))


def test_brightness_without_folding_is_that_of_the_mirrored_half(leaning):
    found = unfolded_brightness(torch.stack([leaning(0.0), leaning(1.0)]))
    assert found[0] == pytest.approx(1, abs=1e-6)
    assert 0.4 < found[1] < 0.8


@pytest.fixture(scope="module")
def one_sided():
    """Fields (4, 675) that were trained without mirrored directions."""
    directions = Directions(above_horizon().nonzero()[::97, 0], 0)
    angles = grid_angles(above_horizon().nonzero()[::97, 0])
    values = torch.stack([GGX(alpha, f0).eval(*angles) for alpha, f0 in ((0.5, 0.9), (0.3, 0.04), (0.8, 0.5))], 1)
    start = random_weights(WIDTHS, 0, "first").expand(3, -1)
    return train(values, directions, start, TRAINING | {"samples": 60_000}, soap, 0, mirrored=0)


def test_mended_fields_show_the_same_by_either_image(one_sided):
    fields, wanted = mended(one_sided), seen(one_sided)
    before, after = unfolded_error(one_sided), unfolded_error(fields)
    assert before.amax() > LIMIT and (after < 0.3 * before).all()
    before, folded, mirrored = (
        (found - wanted).abs().mean((1, 2)) for found in (seen(one_sided, MIRROR), seen(fields), seen(fields, MIRROR))
    )
    assert (folded < 0.005).all() and (mirrored < 0.75 * before).all()


def test_what_is_right_stays_as_it_is(lambert, leaning):
    weights = torch.cat([lambert(0.2, 0.9), leaning(1.0)[None]])
    fields = mended(weights)
    assert torch.equal(fields[:2], weights[:2]) and not torch.equal(fields[2], weights[2])


def test_what_is_not_a_number_does_not_spread(leaning):
    weights = torch.stack([leaning(1.0), torch.full((SIZE,), math.nan), leaning(0.5)])
    fields = mended(weights)
    assert fields[1].isnan().all()
    assert (unfolded_error(fields[::2]) < 0.02).all()
    assert torch.equal(fields[::2], mended(weights[::2]))


def test_a_result_does_not_depend_on_the_others(ladder):
    weights = perturbed(torch.stack([*ladder.values()]))[torch.arange(72) % len(ladder)]
    weights = weights + 0.001 * torch.arange(72)[:, None] / 72
    whole = mended(weights)
    assert torch.equal(whole, torch.cat([mended(part) for part in weights.split(29)]))
    assert torch.equal(whole[70:], mended(weights[70:]))
