import pytest
import torch

from neumat.generative.samplers import SAMPLERS
from neumat.generative.schedule import karras_sigmas

MEAN = torch.tensor([1.5, -2.0])
COVARIANCE = torch.tensor([[1.0, 0.6], [0.6, 0.5]])


def gaussian_posterior_mean(x, sigma):
    """The exact denoiser of N(MEAN, COVARIANCE)."""
    gain = COVARIANCE @ torch.linalg.inv(COVARIANCE + sigma**2 * torch.eye(2))
    return MEAN + (x - MEAN) @ gain.T


def draw(name, steps, n=20_000, seed=0):
    generator = torch.Generator().manual_seed(seed)
    sigmas = karras_sigmas(steps, 0.005, 60.0)
    x = torch.randn(n, 2, generator=generator) * sigmas[0]
    return SAMPLERS[name](gaussian_posterior_mean, x, sigmas, generator)


@pytest.mark.parametrize(("name", "steps"), [("heun", 40), ("dpmpp_2m", 80), ("euler", 400), ("ancestral", 400)])
def test_an_exact_denoiser_gives_the_gaussian_back(name, steps):
    x = draw(name, steps)
    assert torch.allclose(x.mean(0), MEAN, atol=0.04)
    assert torch.allclose(torch.cov(x.T), COVARIANCE, atol=0.04)


@pytest.mark.parametrize("name", ["heun", "dpmpp_2m"])
def test_second_order_samplers_err_less_than_euler_at_equal_evaluations(name):
    exact = draw("heun", 400, n=500)
    evaluations = 40
    steps = evaluations // 2 if name == "heun" else evaluations
    error = (draw(name, steps, n=500) - exact).abs().mean()
    assert error < (draw("euler", evaluations, n=500) - exact).abs().mean() / 2


@pytest.mark.parametrize("name", SAMPLERS)
def test_only_the_ancestral_sampler_uses_the_generator(name):
    sigmas = karras_sigmas(10, 0.01, 10.0)
    x = torch.randn(50, 2, generator=torch.Generator().manual_seed(0)) * 10
    results = [SAMPLERS[name](gaussian_posterior_mean, x, sigmas, torch.Generator().manual_seed(s)) for s in (1, 2)]
    assert torch.equal(*results) == (name != "ancestral")
