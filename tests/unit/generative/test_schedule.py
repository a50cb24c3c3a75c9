import math

import pytest
import torch

from neumat.errors import NeumatError
from neumat.generative.schedule import (
    PRECONDITIONINGS,
    Denoiser,
    edm,
    karras_sigmas,
    linear_sigmas,
    loguniform_sigmas,
)


def test_karras_levels_fall_from_the_largest_to_the_smallest_and_end_in_zero():
    levels = karras_sigmas(20, 0.01, 40.0)
    assert len(levels) == 21
    assert levels[-1] == 0
    assert torch.allclose(levels[[0, -2]], torch.tensor([40.0, 0.01]))
    assert (levels.diff() < 0).all()


def test_the_mended_linear_schedule_keeps_its_start_and_ends_at_the_terminal_snr():
    levels = linear_sigmas(100, 1e-4, 2e-2, terminal=1 / 200)
    assert (levels.diff() > 0).all()
    assert levels[0] == pytest.approx(math.sqrt(1 / (1 - 1e-4) - 1), rel=1e-4)
    assert 1 / math.sqrt(1 + levels[-1] ** 2) == pytest.approx(1 / 200, rel=1e-4)


def test_loguniform_levels_are_stratified():
    levels = loguniform_sigmas(64, 0.1, 10.0, torch.Generator().manual_seed(0))
    strata = (torch.log(levels / 0.1) / math.log(100) * 64).floor().long().clamp_max(63)
    assert torch.equal(strata, torch.arange(64))


@pytest.mark.parametrize("name", PRECONDITIONINGS)
@pytest.mark.parametrize("sigma", [0.01, 0.5, 3.0, 80.0])
def test_preconditioned_inputs_and_targets_have_unit_variance(name, sigma):
    generator = torch.Generator().manual_seed(0)
    sigma_data = 0.7
    clean = sigma_data * torch.randn(200_000, generator=generator)
    x = clean + sigma * torch.randn(200_000, generator=generator)
    c_skip, c_out, c_in = PRECONDITIONINGS[name](torch.tensor(sigma), sigma_data)
    assert (c_in * x).var().item() == pytest.approx(1, abs=0.02)
    assert ((clean - c_skip * x) / c_out).var().item() == pytest.approx(1, abs=0.02)


def test_edm_scales_the_network_by_the_error_of_the_best_linear_denoiser():
    # c_skip x is the posterior mean of N(0, sigma_data^2) data, c_out its root-mean-square error.
    sigma, sigma_data = torch.tensor(2.0), 0.5
    c_skip, c_out, _ = edm(sigma, sigma_data)
    assert c_skip.item() == pytest.approx(0.25 / 4.25)
    assert c_out.item() ** 2 == pytest.approx(4 * 0.25 / 4.25)


def test_a_perfect_network_has_no_loss():
    clean, noise = torch.randn(2, 8, 3, generator=torch.Generator().manual_seed(1))
    sigma = torch.linspace(0.1, 5, 8)

    def oracle(_, __):
        c_skip, c_out, _ = (c[:, None] for c in edm(sigma, 1.0))
        return (clean - c_skip * (clean + sigma[:, None] * noise)) / c_out

    denoiser = Denoiser(oracle)
    assert denoiser.loss(clean, sigma, noise).item() < 1e-10
    assert torch.allclose(denoiser(clean + sigma[:, None] * noise, sigma), clean, atol=1e-4)


def test_an_unknown_preconditioning_is_refused():
    with pytest.raises(NeumatError, match="edm"):
        Denoiser(None, "ddpm")
