import pytest
import torch

from neumat.brdf.coordinates import half_difference
from neumat.fields.field import log_reflectance
from neumat.fields.layout import SIZE
from neumat.generative.mixing import last_layer, mixtures
from neumat.generative.whitening import Coordinates


def generator():
    return torch.Generator().manual_seed(0)


@pytest.fixture
def weights():
    return 0.3 * torch.randn(12, SIZE, generator=generator())


def test_mixtures_of_one_material_raise_1_plus_f_to_a_power(weights):
    one = weights[:1]
    mixed = mixtures(one, last_layer(one), 200, 0.2, generator())
    angles = torch.rand(30, generator=generator())
    inputs = half_difference(angles, angles, angles)
    ratio = log_reflectance(mixed, inputs.float()) / log_reflectance(one, inputs.float())
    assert torch.allclose(ratio, ratio[:, :1, :1].expand_as(ratio), rtol=1e-3)
    power = ratio[:, 0, 0].log()
    assert power.mean().abs() < 0.05 and power.std() == pytest.approx(0.2, rel=0.2)


def test_without_a_spread_mixtures_lie_between_two_materials(weights):
    mixed = mixtures(weights, last_layer(weights), 50, 0.0, generator())
    ends = torch.combinations(torch.arange(12))
    first, second = weights[ends[:, 0]], weights[ends[:, 1]]
    direction = second - first
    share = ((mixed[:, None] - first) * direction).sum(2) / direction.square().sum(1)
    gap = (mixed[:, None] - torch.lerp(first, second, share[..., None])).norm(dim=2).amin(1)
    # Both may be the same material.
    same = torch.cdist(mixed, weights).amin(1)
    assert torch.minimum(gap, same).max() < 1e-4


def test_mixtures_are_the_same_in_coordinates(weights):
    """What is learnt in coordinates, without a product for each example, is what null baselines draw as weights."""
    coordinates = Coordinates.fit(weights, 400, "variance", 0.5, generator())
    last = last_layer(weights)
    direct = mixtures(weights, last, 30, 0.3, generator())
    found = mixtures(coordinates.encode(weights), coordinates.encode_change(last), 30, 0.3, generator())
    assert torch.allclose(found, coordinates.encode(direct), atol=1e-4)
