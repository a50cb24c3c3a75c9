"""Noise levels and preconditioning. Everywhere x = x0 + sigma noise (variance exploding, Karras et al. 2022).

A discrete schedule of the variance-preserving kind is the same thing seen through sigma = sqrt(1/alpha_bar - 1).
"""

import torch

from neumat.errors import NeumatError


def karras_sigmas(steps, sigma_min, sigma_max, rho=7.0):
    """Return (steps + 1,) levels from sigma_max down to sigma_min, then 0 (Karras et al. 2022, eq. 5)."""
    ramp = torch.linspace(0, 1, steps, dtype=torch.float64)
    levels = (sigma_max ** (1 / rho) + ramp * (sigma_min ** (1 / rho) - sigma_max ** (1 / rho))) ** rho
    return torch.cat([levels, torch.zeros(1, dtype=torch.float64)]).float()


def lognormal_sigmas(n, mean, std, generator):
    """Return (n,) training levels, ln sigma ~ N(mean, std^2) (Karras et al. 2022, table 1)."""
    return torch.exp(mean + std * torch.randn(n, generator=generator))


def loguniform_sigmas(n, sigma_min, sigma_max, generator):
    """Return (n,) training levels, ln sigma uniform, one in each of n equal strata (Kingma et al. 2021, sec. 5.2)."""
    u = (torch.arange(n) + torch.rand(n, generator=generator)) / n
    return sigma_min * (sigma_max / sigma_min) ** u


def linear_sigmas(steps=100, beta_first=1e-4, beta_last=2e-2, terminal=1 / 200):
    """Return (steps,) ascending levels of the linear beta schedule (Ho et al. 2020) with its terminal SNR mended.

    Over 100 steps those betas leave sqrt(alpha_bar) at 0.6, so that sampling would start where training never was.
    sqrt(alpha_bar) is shifted and scaled so that the first level stays and the last is `terminal` (Lin et al. 2024,
    algorithm 1, with a small number for their 0, so that sigma stays finite).
    """
    root = torch.cumprod(1 - torch.linspace(beta_first, beta_last, steps, dtype=torch.float64), 0).sqrt()
    root = terminal + (root - root[-1]) * (root[0] - terminal) / (root[0] - root[-1])
    return torch.sqrt(1 / root**2 - 1).float()


def edm(sigma, sigma_data):
    """c_skip, c_out, c_in of Karras et al. 2022, table 1; the same as the v target of Salimans & Ho 2022."""
    total = sigma**2 + sigma_data**2
    return sigma_data**2 / total, sigma * sigma_data / total.sqrt(), 1 / total.sqrt()


def eps(sigma, sigma_data):
    """The network predicts the noise (Ho et al. 2020)."""
    return torch.ones_like(sigma), -sigma, 1 / (sigma**2 + sigma_data**2).sqrt()


def x0(sigma, sigma_data):
    """The network predicts the clean data."""
    return torch.zeros_like(sigma), torch.full_like(sigma, sigma_data), 1 / (sigma**2 + sigma_data**2).sqrt()


PRECONDITIONINGS = {"edm": edm, "eps": eps, "x0": x0}


class Denoiser:
    """D(x, sigma) = c_skip x + c_out network(c_in x, ln(sigma) / 4) (Karras et al. 2022, eq. 7)."""

    def __init__(self, network, preconditioning="edm", sigma_data=1.0):
        if preconditioning not in PRECONDITIONINGS:
            raise NeumatError("preconditioning", f"one of {', '.join(PRECONDITIONINGS)}", preconditioning)
        self.network = network
        self.scalings = PRECONDITIONINGS[preconditioning]
        self.sigma_data = sigma_data

    def __call__(self, x, sigma):
        """Return the denoised data (n, k) of x (n, k) at levels sigma, () or (n,)."""
        sigma = sigma.expand(len(x))
        c_skip, c_out, c_in = (c[:, None] for c in self.scalings(sigma, self.sigma_data))
        return c_skip * x + c_out * self.network(c_in * x, sigma.log() / 4).float()

    def loss(self, clean, sigma, noise):
        """Return the mean squared error of the network's output against its target: a weight of 1 / c_out^2."""
        c_skip, c_out, c_in = (c[:, None] for c in self.scalings(sigma, self.sigma_data))
        x = clean + sigma[:, None] * noise
        return ((self.network(c_in * x, sigma.log() / 4).float() - (clean - c_skip * x) / c_out) ** 2).mean()
