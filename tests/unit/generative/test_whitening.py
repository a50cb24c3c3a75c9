import math

import pytest
import torch

from neumat.brdf.coordinates import half_difference
from neumat.errors import NeumatError
from neumat.fields.field import log_reflectance
from neumat.fields.layout import SIZE
from neumat.generative import whitening
from neumat.generative.whitening import Coordinates, effect_metric


def generator():
    return torch.Generator().manual_seed(0)


@pytest.fixture(scope="module")
def weights():
    mixing = torch.randn(12, SIZE, generator=generator()) / 12**0.5
    return 0.03 + 0.1 * torch.randn(300, 12, generator=torch.Generator().manual_seed(1)) @ mixing


@pytest.fixture(scope="module")
def effect(weights):
    """The metric of these weights, which takes seconds, for all powers."""
    return effect_metric(weights, generator())


@pytest.mark.parametrize("metric", ["variance", "effect"])
@pytest.mark.parametrize("power", [0.0, 0.5, 1.0])
def test_weights_come_back_through_the_coordinates(weights, metric, power, effect, monkeypatch):
    monkeypatch.setattr(whitening, "effect_metric", lambda *_: effect)
    coordinates = Coordinates.fit(weights, SIZE, metric, power, generator())
    encoded = coordinates.encode(weights)
    assert encoded.shape[1] <= 20  # the rank of the data, not 675
    assert torch.allclose(coordinates.decode(encoded), weights, atol=1e-4)
    assert encoded.mean(0).abs().max() < 1e-3
    assert encoded.square().mean().item() == pytest.approx(1, rel=1e-3)


def test_power_one_whitens(weights):
    encoded = Coordinates.fit(weights, 12, "variance", 1.0, generator()).encode(weights)
    assert torch.allclose(torch.cov(encoded.T, correction=0), torch.eye(12), atol=1e-3)


def test_fewer_components_keep_the_directions_of_largest_variance(weights):
    coordinates = Coordinates.fit(weights, 4, "variance", 0.0, generator())
    spread = coordinates.encode(weights).std(0)
    assert len(spread) == 4
    assert (spread.diff() <= 0).all()


def test_standard_coordinates_are_the_weights_one_by_one(weights):
    weights = weights.clone()
    weights[:, 5] = 0.1  # a mean that rounds, so its deviations may be tiny and not 0
    coordinates = Coordinates.fit(weights, 4, "standard", 0.5, generator())
    encoded = coordinates.encode(weights)
    assert encoded.shape == weights.shape
    assert torch.allclose(coordinates.decode(encoded), weights, atol=1e-6)
    assert encoded.mean(0).abs().max() < 1e-6
    square = encoded.double().square().mean(0)
    assert square[5] == 0 and torch.allclose(square[torch.arange(SIZE) != 5], torch.ones(SIZE - 1).double(), atol=1e-5)
    for i in (3, 5):  # no weight moves another's coordinate; one that never varied moves none and keeps its value
        moved = weights.clone()
        moved[:, i] += 1
        change = coordinates.encode(moved) - encoded
        assert (change.abs().sum(0) > 0).nonzero().flatten().tolist() == ([3] if i == 3 else [])
    assert coordinates.decode(torch.randn(8, SIZE, generator=generator()))[:, 5] == pytest.approx([0.1] * 8)


def constant_field(reflectance):
    """A field (1, 675) of one reflectance, 1/sr, in all directions."""
    weights = torch.zeros(1, SIZE)
    weights[0, -3:] = math.log1p(reflectance)
    return weights


def test_the_effect_metric_of_constant_fields_is_known():
    # Of a blinding field only the logarithm moves, by delta for a shift delta of one channel's bias.
    assert effect_metric(constant_field(1e5), generator()).diagonal()[-3:] == pytest.approx([1 / 3] * 3, rel=1e-2)
    # Of a black one the tone moves by 12.92 * 2.5 delta cos, far more than the logarithm's delta cos.
    black = effect_metric(constant_field(1e-5), generator(), directions=1024).diagonal()[-3:] * 3
    assert (black / (12.92 * 2.5) ** 2 > 0.1).all() and (black / (12.92 * 2.5) ** 2 < 1).all()


def test_the_effect_metric_sees_what_reaches_the_output():
    one = torch.randn(1, SIZE, generator=generator()) * 0.2
    metric = effect_metric(one, generator())
    assert torch.allclose(metric, metric.T)
    assert torch.linalg.eigvalsh(metric)[0] > -1e-6
    u = torch.rand(2048, 3, generator=generator())
    inputs = half_difference(u[:, 0] ** 2 * 1.2, u[:, 1] * 0.3, u[:, 2] * 3.1)
    dead = one.clone()
    dead[0, 126:147] = -100.0  # biases that close every hidden neuron: no effect left in the layers before
    assert torch.isfinite(log_reflectance(dead[0], inputs)).all()
    assert effect_metric(dead, generator())[:126, :126].abs().max() == 0


def test_an_unknown_metric_is_refused(weights):
    with pytest.raises(NeumatError, match="effect"):
        Coordinates.fit(weights, 4, "fisher", 0.0, generator())
