"""Samplers: each takes `denoise(x, sigma)`, a start x (n, k) of standard deviation sigmas[0], descending levels that
may end in 0, and a torch Generator that only the stochastic ones use."""

from itertools import pairwise

import torch


def sample_euler(denoise, x, sigmas, generator=None):
    """First-order probability flow: DDIM (Song et al. 2021) in the sigma parametrisation. Deterministic."""
    for sigma, following in pairwise(sigmas):
        x = torch.lerp(denoise(x, sigma), x, following / sigma)
    return x


def sample_heun(denoise, x, sigmas, generator=None):
    """Second-order probability flow (Karras et al. 2022, algorithm 1); two evaluations a step. Deterministic."""
    for sigma, following in pairwise(sigmas):
        slope = (x - denoise(x, sigma)) / sigma
        guess = x + slope * (following - sigma)
        if following > 0:
            slope = (slope + (guess - denoise(guess, following)) / following) / 2
            guess = x + slope * (following - sigma)
        x = guess
    return x


def sample_dpmpp_2m(denoise, x, sigmas, generator=None):
    """DPM-Solver++(2M) (Lu et al. 2022, algorithm 2): second order from one evaluation a step. Deterministic."""
    previous = before = None
    for sigma, following in pairwise(sigmas):
        denoised = target = denoise(x, sigma)
        if previous is not None and following > 0:
            ratio = torch.log(sigma / following) / torch.log(before / sigma)
            target = denoised + (denoised - previous) * ratio / 2
        x = torch.lerp(target, x, following / sigma)
        previous, before = denoised, sigma
    return x


def sample_ancestral(denoise, x, sigmas, generator=None):
    """DDPM's own reverse process (Ho et al. 2020, eq. 6 and 7) in the sigma parametrisation. Stochastic."""
    for sigma, following in pairwise(sigmas):
        share = (following / sigma) ** 2
        spread = following * torch.sqrt(1 - share)
        noise = torch.randn(x.shape, generator=generator, device=x.device)
        x = torch.lerp(denoise(x, sigma), x, share) + spread * noise
    return x


SAMPLERS = {
    "heun": sample_heun,
    "euler": sample_euler,
    "dpmpp_2m": sample_dpmpp_2m,
    "ancestral": sample_ancestral,
}
EVALUATIONS = {"heun": 2, "euler": 1, "dpmpp_2m": 1, "ancestral": 1}  # of the denoiser, a step
