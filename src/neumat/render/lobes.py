"""Densities from which a material's directions are drawn: a cosine lobe and GGX lobes, mixed to fit the material.

The lobes are those of `neumat.render.quadrature`. Their shares depend on the polar angle between view and normal. Such
a mixture leaves less variance than a tabulated density of half vectors (mirrors: 2 to 3 times less), which can't turn
away from half vectors that a grazing view doesn't see.
"""

import functools
import math

import torch

from neumat.brdf.coordinates import rusinkiewicz
from neumat.errors import NeumatError
from neumat.render.quadrature import STRATEGIES, ggx_density, hemisphere

ALPHAS = tuple(alpha for alpha in STRATEGIES if alpha is not None)  # roughness of the GGX lobes
ANGLES = 16  # polar angles of the view, at the middle of equal intervals from 0 to pi / 2
LEAST_COSINE = 0.05  # share of the cosine lobe at least: no direction goes unseen, whatever the fit has missed
# How many times, on average over the angles, the second moment of the cosine lobe alone must exceed that of a mixture:
# choosing among lobes costs the samples some of their stratification (up to .15 dB at 64 a pixel), which is more than
# lobes save on matte materials.
LEAST_GAIN = 1.1
STEPS = 30
SAMPLERS = ("fitted", "ggx", "cosine", "uniform")


@functools.cache
def _nodes():
    """Return angles (three of (ANGLES * n,)), cosine, weight (ANGLES, n) and lobe densities (1 + ALPHAS, ANGLES, n)."""
    theta = (torch.arange(ANGLES, dtype=torch.float64) + 0.5) / ANGLES * (math.pi / 2)
    light, view, weight = hemisphere(theta)
    angles = [torch.where(weight > 0, a, 0.0).flatten().float() for a in rusinkiewicz(light, view[:, None])]
    cosine = light[..., 2].clamp_min(0)
    densities = torch.stack([cosine / math.pi, *(ggx_density(light, view, alpha) for alpha in ALPHAS)])
    return angles, cosine.float(), weight.float(), densities.float()


def fit_lobes(material, sampler="fitted"):
    """Return the shares (ANGLES, len(ALPHAS)), float32, of the GGX lobes for a material; the cosine lobe has the rest.

    material: anything with `eval(theta_h, theta_d, phi_d)`. sampler: "fitted"; "ggx", the best one of the GGX lobes
    beside the cosine lobe; "cosine" and "uniform" have none. Minimises the variance under even light, summed over the
    channels, by expectation maximisation (Douc et al. 2007, Minimum variance importance sampling via population Monte
    Carlo).
    """
    shares = torch.zeros(ANGLES, len(ALPHAS))
    if sampler in ("cosine", "uniform"):
        return shares
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # on tensors this small, threads that wait for each other cost 100 times the work
    try:
        densities, energy = _reflected(material)
        if sampler == "fitted":
            return _mixture(densities, energy)[0][1:].T.contiguous()
        fits = [_mixture(densities[[0, 1 + k]], energy) for k in range(len(ALPHAS))]
    finally:
        torch.set_num_threads(threads)
    best = min(range(len(fits)), key=lambda k: float(fits[k][1].sum()))
    shares[:, best] = fits[best][0][1]
    return shares


def write_lobes(shares):
    """Return the text of shares (ANGLES, len(ALPHAS)), which `read_lobes` reads to the last bit."""
    return " ".join(repr(float(share)) for share in shares.flatten())


def read_lobes(text):
    """Return the shares (ANGLES, len(ALPHAS)), float32, of a text of numbers.

    Raises NeumatError for another number of them, and for shares that are no part of a whole.
    """
    expected = f"{ANGLES * len(ALPHAS)} shares, {len(ALPHAS)} of 0..1 to each of {ANGLES} angles, 1 together at most"
    try:
        shares = torch.tensor([float(number) for number in text.split()])
    except ValueError as error:
        raise NeumatError("lobes", expected, error) from error
    if len(shares) != ANGLES * len(ALPHAS):
        raise NeumatError("lobes", expected, f"{len(shares)} numbers")
    shares = shares.view(ANGLES, -1)
    if not ((shares >= 0).all() and (shares.sum(1) <= 1 + 1e-6).all()):
        raise NeumatError("lobes", expected, f"{shares.min():g} to {shares.max():g}, {shares.sum(1).max():g} together")
    return shares


def _reflected(material):
    """Return the lobes' densities (1 + ALPHAS, ANGLES, n) at the nodes, and the material's (f cos)^2, each angle's
    integral being 1."""
    angles, cosine, weight, densities = _nodes()
    # Values that are not finite, and materials that are black, say nothing.
    values = material.eval(*angles).nan_to_num(0.0, 0.0, 0.0).double()
    energy = (values.square().mean(1).view_as(cosine) * cosine**2 * weight).float()
    return densities, energy / energy.sum(1, keepdim=True).clamp_min(1e-30)


def _mixture(densities, energy):
    """Return the shares (lobes, ANGLES) that minimise each angle's second moment, the sum of energy / density over
    nodes, and that moment (ANGLES,); the cosine lobe has all where the others save too little."""
    shares = torch.full(densities.shape[:2], 1 / len(densities))
    for _ in range(STEPS):
        total = (shares[..., None] * densities).sum(0).clamp_min(1e-12)
        gain = shares * (densities * (energy / total**2)).sum(-1)
        shares = gain / gain.sum(0).clamp_min(1e-30)
        # Where nothing is reflected there is no gain, and the cosine lobe takes all.
        shares[0] = shares[0].clamp_min(LEAST_COSINE)
        shares = shares / shares.sum(0)
    cosine = torch.zeros_like(shares)
    cosine[0] = 1
    mixed, alone = (
        (energy / (parts[..., None] * densities).sum(0).clamp_min(1e-12)).sum(1) for parts in (shares, cosine)
    )
    poor = (alone / mixed.clamp_min(1e-30)).mean() < LEAST_GAIN
    return torch.where(poor, cosine, shares), torch.where(poor, alone, mixed)


def check_sampler(name):
    """Raise NeumatError where `name` is not one of SAMPLERS."""
    if name not in SAMPLERS:
        raise NeumatError("sampler", f"one of {', '.join(SAMPLERS)}", repr(name))
