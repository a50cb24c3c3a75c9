import numpy as np
import pytest
import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE, permute_channels
from neumat.fields.mirrored import LIMIT, unfolded_error
from neumat.generative.base import Dataset
from neumat.generative.hyperdiffusion import HyperDiffusion, linear_sigmas, noisy_share
from neumat.generative.orders import ORDERS
from neumat.generative.samplers import EVALUATIONS, SAMPLERS

TOY = {"network": {"width": 32, "depth": 1}, "components": 6, "batch": 32}


def generator():
    return torch.Generator().manual_seed(0)


def dataset(weights):
    n = len(weights)
    return Dataset(weights, np.arange(n), np.zeros(n, int), np.ones(n, bool))


def test_a_gaussian_of_weights_is_learned():
    generator = torch.Generator().manual_seed(0)
    mixing = torch.randn(2, SIZE, generator=generator)
    weights = 1 + torch.randn(2000, 2, generator=generator) @ mixing
    model = HyperDiffusion(**TOY | {"components": 2, "batch": 256, "steps": 600}).fit(dataset(weights), seed=0)
    samples = model.draw(2000, seed=1)
    into = torch.linalg.pinv(mixing)
    truth, found = (weights - 1) @ into, (samples - 1) @ into
    assert torch.allclose(found.mean(0), truth.mean(0), atol=0.25)
    assert torch.allclose(torch.cov(found.T), torch.cov(truth.T), atol=0.25)


def test_sorting_learns_all_orders_of_the_channels_from_any():
    """Samples of what is learnt from blue materials alone have each order of the channels equally often."""
    weights = torch.zeros(60, SIZE)
    weights[:, -3:] = torch.tensor([0.05, 0.1, 0.3]) + 0.005 * torch.randn(60, 3, generator=generator())
    other = torch.cat([permute_channels(weights[::2], "gbr"), permute_channels(weights[1::2], "grb")])
    config = TOY | {"components": 3, "steps": 300, "sort": True}
    blue = HyperDiffusion(**config).fit(dataset(torch.cat([weights[::2], weights[1::2]])), seed=0)
    mixed = HyperDiffusion(**config).fit(dataset(other), seed=0)
    samples = blue.draw(600, seed=1).numpy()
    assert samples == pytest.approx(mixed.draw(600, seed=1).numpy(), abs=1e-4)
    found = torch.from_numpy(samples[:, -3:]).argsort(1)
    counts = (found[:, None] == ORDERS).all(2).sum(0)
    assert counts.sum() == 600 and counts.min() > 70
    assert np.sort(samples[:, -3:]).mean(0) == pytest.approx([0.05, 0.1, 0.3], abs=0.02)


def test_mixing_learns_what_lies_between_measured_materials():
    """Of two measured materials the model makes what no training material is; blends take no part in it."""
    generator = torch.Generator().manual_seed(0)
    weights = torch.cat([torch.zeros(1, SIZE), torch.ones(1, SIZE), 5 * torch.randn(8, SIZE, generator=generator)])
    found = dataset(weights)
    found.is_source[2:] = False
    config = TOY | {"components": 9, "batch": 256, "steps": 400, "mixing": 0.0}
    samples = HyperDiffusion(**config).fit(found, seed=0).draw(400, seed=1)
    share = samples.mean(1)
    assert (samples - share[:, None]).abs().mean() < 0.2
    assert share.mean() == pytest.approx(0.5, abs=0.1) and share.std() == pytest.approx(
        6**-0.5, abs=0.05
    )  # half of the pairs are one twice


def test_what_begins_with_a_material_ends_with_its_order_of_channels():
    weights = torch.zeros(60, SIZE)
    weights[:, -3:] = torch.tensor([0.05, 0.1, 0.3]) + 0.005 * torch.randn(60, 3, generator=generator())
    model = HyperDiffusion(**TOY | {"components": 3, "steps": 50, "sort": True}).fit(dataset(weights), seed=0)
    coordinates, denoiser = model.restored()
    start = torch.cat([permute_channels(weights[:1], order) for order in PERMUTATIONS])
    ended = model.integrate(lambda x, sigma, rows: denoiser(x, sigma), coordinates, 6, 1, (start, 0.1))
    assert torch.equal(ended[:, -3:].argsort(1), start[:, -3:].argsort(1))


def test_samples_are_right_without_folding_where_draws_are_not(leaning):
    weights = leaning(1.0) + 0.001 * torch.randn(60, SIZE, generator=generator())
    model = HyperDiffusion(**TOY | {"steps": 100}).fit(dataset(weights), seed=0)
    drawn, samples = model.draw(20, seed=1), torch.from_numpy(model.sample(20, seed=1))
    assert (unfolded_error(drawn) > LIMIT).all() and (unfolded_error(samples) < 0.05).all()


@pytest.mark.parametrize("tokens", ["layer", "neuron"])
def test_a_transformer_over_layers_or_neurons_samples_weights(tokens):
    weights = 2 + 0.1 * torch.randn(20, SIZE, generator=torch.Generator().manual_seed(0))
    weights[:, -1] = 0.5
    network = {"tokens": tokens, "width": 16, "depth": 1, "heads": 2}
    model = HyperDiffusion(denoiser="transformer", network=network, metric="standard", batch=8, steps=5, nfe=6)
    samples = model.fit(dataset(weights), seed=0).draw(3, seed=1).numpy()
    assert samples.shape == (3, SIZE) and np.isfinite(samples).all()
    assert samples[:, -1] == pytest.approx([0.5] * 3)
    assert samples.mean() == pytest.approx(2, abs=0.1)


@pytest.mark.parametrize("metric", ["variance", "effect"])
@pytest.mark.parametrize("network", [{"tokens": "layer"}, {"tokens": "neuron"}, {}])
def test_rotated_coordinates_have_no_layers_or_neurons(metric, network):
    with pytest.raises(NeumatError, match=f"metric standard: {metric} rotates the weights; found"):
        HyperDiffusion(denoiser="transformer", network=network, metric=metric)
    HyperDiffusion(denoiser="transformer", network={"tokens": 15}, metric=metric)


@pytest.mark.parametrize("sampler", SAMPLERS)
def test_a_sampler_spends_the_evaluations_it_is_given(sampler):
    model = HyperDiffusion(sampler=sampler, nfe=40)
    assert len(model.sampling_levels()) == 40 // EVALUATIONS[sampler] + 1


def test_the_linear_schedule_is_sampled_at_levels_that_training_saw():
    levels = HyperDiffusion(noise="linear", sampler="ancestral", nfe=100).sampling_levels()
    assert torch.equal(levels[:-1], linear_sigmas().flip(0))


@pytest.mark.parametrize("deviation", [0.5, 2.0])
def test_an_ideal_denoiser_leaves_no_share_to_the_noisy_sample(deviation):
    """Of normal data it is the shrunken x (Tweedie's formula)."""
    data = deviation * torch.randn(20000, 3, generator=torch.Generator().manual_seed(0))
    share = noisy_share(
        lambda x, sigma: x / (1 + sigma**2 / deviation**2), data, torch.tensor(0.4), torch.Generator().manual_seed(1)
    )
    assert share.max() < 0.1


def test_a_denoiser_that_errs_leaves_the_noisy_sample_the_share_of_its_error():
    error, sigma = torch.tensor([0.0, 0.1, 0.3]), torch.tensor(0.4)
    data = torch.zeros(20000, 3)
    share = noisy_share(lambda x, sigma: error.expand(len(x), -1), data, sigma, torch.Generator().manual_seed(0))
    assert torch.allclose(share, error**2 / (error**2 + sigma**2), atol=0.02)


@pytest.mark.parametrize("sampler", ["heun", "euler", "dpmpp_2m"])
def test_the_last_step_keeps_that_share_of_the_lowest_noise(sampler):
    """A denoiser that says 0 leaves x = sigma noise at every level."""
    weights = torch.randn(50, SIZE, generator=torch.Generator().manual_seed(0))
    model = HyperDiffusion(**TOY, steps=2, sampler=sampler, sigma_min=0.2).fit(dataset(weights), seed=0)
    model.state["share"] = torch.tensor([0.0, 0.25, 0.5, 0.75, 1.0, 1.0])
    coordinates, _ = model.restored()
    samples = model.integrate(lambda x, sigma, rows: torch.zeros_like(x), coordinates, 4000, seed=1)
    assert torch.allclose(coordinates.encode(samples).std(0), 0.2 * model.state["share"], atol=0.01)


@pytest.mark.parametrize(
    "config", [{"denoiser": "unet"}, {"sampler": "plms"}, {"noise": "cosine"}, {"network": {"heads": 3}}]
)
def test_unknown_names_are_refused(config):
    with pytest.raises(NeumatError):
        HyperDiffusion(**config).fit(dataset(torch.randn(5, SIZE)), seed=0)
