"""Diffusion over the weight vectors of neural fields (Erkoc et al. 2023; M3ashy's unconditional model)."""

import functools
import logging
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import torch

from neumat.errors import NeumatError
from neumat.fields.mirrored import SERVED, unfolded_error
from neumat.generative.anew import served
from neumat.generative.base import GenerativeModel
from neumat.generative.denoisers import DENOISERS
from neumat.generative.mixing import last_layer, mixtures
from neumat.generative.orders import ORDERS, brightest_first, reorder
from neumat.generative.samplers import EVALUATIONS, SAMPLERS
from neumat.generative.schedule import (
    Denoiser,
    karras_sigmas,
    linear_sigmas,
    lognormal_sigmas,
    loguniform_sigmas,
)
from neumat.generative.training import device, seeded, train
from neumat.generative.whitening import Coordinates
from neumat.seeds import torch_generator

SAMPLE_BATCH = 1024
REPRESENTATIVE = 4000  # mixtures that stand for all of them where coordinates are fitted
NOISE = ("lognormal", "loguniform", "linear")


@dataclass(kw_only=True)
class HyperDiffusion(GenerativeModel):
    """A denoiser of weight vectors in fitted coordinates, and a sampler.

    denoiser, network: a name in DENOISERS and its keyword arguments. components, metric, power: see Coordinates.
    preconditioning: a name in PRECONDITIONINGS. noise: "lognormal" levels (log_mean, log_std), "loguniform" ones
    (sigma_min, sigma_max), both sampled at Karras's levels, or "linear", the mended 100-step beta schedule.
    sort: whether materials are learnt with their brightest channel first, and samples' channels permuted at random, see
    `orders`. dense: whether the dense bases are trained on too: for who makes the dataset. mixing: None, or the spread
    of the `mixtures` of measured training materials that are learnt in place of all training materials as they are;
    the others then only have a say in the coordinates. steps, batch, lr, lr_end, warmup, ema, weight_decay, precision:
    see train. sampler: a name in SAMPLERS; nfe: evaluations of the denoiser a sample.
    """

    denoiser: str = "mlp"
    network: dict = field(default_factory=dict)
    components: int = 256
    metric: str = "variance"
    power: float = 1.0
    preconditioning: str = "edm"
    noise: str = "loguniform"
    log_mean: float = -0.5
    log_std: float = 1.4
    sigma_min: float = 0.01
    sigma_max: float = 40.0
    sort: bool = False
    dense: bool = False
    mixing: float | None = None
    steps: int = 5000
    batch: int = 512
    lr: float = 1e-3
    lr_end: float = 1e-5
    warmup: int = 200
    ema: float = 0.999
    weight_decay: float = 0.0
    precision: str = "auto"
    sampler: str = "heun"
    nfe: int = 50

    def __post_init__(self):
        for name, value, known in (
            ("denoiser", self.denoiser, DENOISERS),
            ("sampler", self.sampler, SAMPLERS),
            ("noise", self.noise, NOISE),
        ):
            if value not in known:
                raise NeumatError(name, f"one of {', '.join(known)}", value)
        tokens = self.network.get("tokens", "layer")  # as TokenTransformer has it
        if self.denoiser == "transformer" and isinstance(tokens, str) and self.metric != "standard":
            expected = f"a chunk length, or metric standard: {self.metric} rotates the weights"
            raise NeumatError("tokens", expected, tokens)

    def _denoiser(self, size, seed=0):
        try:
            with seeded(seed, "initial weights"):
                network = DENOISERS[self.denoiser](size, **self.network)
        except TypeError as error:
            raise NeumatError(f"network of {self.denoiser}", "its own arguments", error) from error
        return Denoiser(network.to(device()), self.preconditioning)

    def _training_levels(self, generator):
        if self.noise == "lognormal":
            return lognormal_sigmas(self.batch, self.log_mean, self.log_std, generator)
        if self.noise == "loguniform":
            return loguniform_sigmas(self.batch, self.sigma_min, self.sigma_max, generator)
        levels = linear_sigmas()
        return levels[torch.randint(len(levels), (self.batch,), generator=generator)]

    def sampling_levels(self):
        """Return the descending noise levels of sampling, the last one 0."""
        steps = max(2, self.nfe // EVALUATIONS[self.sampler])
        if self.noise == "linear":
            levels = linear_sigmas().flip(0)
            chosen = torch.linspace(0, len(levels) - 1, min(steps, len(levels))).round().long()
            return torch.cat([levels[chosen], torch.zeros(1)])
        return karras_sigmas(steps, self.sigma_min, self.sigma_max)

    def _fit(self, dataset, seed, progress, checkpoint):
        weights = self.sorted(dataset.weights)[0]
        measured = weights[torch.as_tensor(np.flatnonzero(dataset.is_source))]
        learnt = spanned = weights
        if self.mixing is not None:
            given = measured, last_layer(measured), REPRESENTATIVE, self.mixing
            learnt = mixtures(*given, torch_generator(seed, "mixtures"))
            spanned = torch.cat([weights, learnt])  # requests are learnt from the training materials themselves
        generator = torch_generator(seed, "metric")
        coordinates = Coordinates.fit(spanned, self.components, self.metric, self.power, generator)
        data, ends = coordinates.encode(learnt), coordinates.encode(measured)
        last = coordinates.encode_change(last_layer(measured))
        denoiser = self._denoiser(data.shape[1], seed)
        on = device()

        def loss(generator):
            if self.mixing is None:
                clean = data[torch.randint(len(data), (self.batch,), generator=generator)]
            else:
                clean = mixtures(ends, last, self.batch, self.mixing, generator)
            noise = torch.randn(clean.shape, generator=generator)
            return denoiser.loss(clean.to(on), self._training_levels(generator).to(on), noise.to(on))

        train(
            denoiser.network, loss, steps=self.steps, lr=self.lr, lr_end=self.lr_end, warmup=self.warmup,
            ema=self.ema, weight_decay=self.weight_decay, precision=self.precision, seed=seed,
            progress=progress, checkpoint=checkpoint and Path(checkpoint), identity=asdict(self),
        )  # fmt: skip
        share = noisy_share(denoiser, data, self.sampling_levels()[-2], torch_generator(seed, "share"))
        network = {f"network.{name}": value.cpu() for name, value in denoiser.network.state_dict().items()}
        state = {f"coordinates.{name}": value for name, value in coordinates.state().items()}
        return {"share": share} | state | network

    def sorted(self, weights):
        """Return (the fields (n, 675) as they are learnt, the orders (n,) of channels that give `weights` again)."""
        return brightest_first(weights) if self.sort else (weights, torch.zeros(len(weights), dtype=torch.long))

    def restored(self):
        """Return (Coordinates, Denoiser) as fitted."""
        part = {
            prefix: {k.removeprefix(prefix): v for k, v in self.state.items() if k.startswith(prefix)}
            for prefix in ("coordinates.", "network.")
        }
        coordinates = Coordinates(**part["coordinates."])
        denoiser = self._denoiser(coordinates.into.shape[1])
        denoiser.network.load_state_dict(part["network."])
        denoiser.network.eval()
        return coordinates, denoiser

    def draw(self, n, seed, start=None):
        """Return weights (n, 675) as the sampler leaves them: some may be no valid BRDF. start: see `integrate`."""
        coordinates, denoiser = self.restored()
        return self.integrate(lambda x, sigma, rows: denoiser(x, sigma), coordinates, n, seed, start)

    def _sample(self, n, seed):
        """Return samples that other programs show right, see `fields.mirrored`; they may be no valid BRDF otherwise."""

        def right(weights):
            return unfolded_error(weights) <= SERVED

        weights, drawn = served(
            lambda rows, seed, share: (self.draw(len(rows), seed), len(rows)), n, seed, "samples", right
        )
        logging.info("%d samples; %d more were drawn that showed wrong without folding phi_d", n, drawn - n)
        return weights.numpy()

    @torch.no_grad()
    def integrate(self, denoise, coordinates, n, seed, start=None, likely=None):
        """Return weights (n, 675) sampled by `denoise(x, sigma, rows)`, rows the slice of the n that x stands for; the
        last step, from the lowest level to 0, keeps the `noisy_share` of x.

        start: (weights (n, 675), level), where sampling begins with these at that level of noise (SDEdit, Meng et al.
        2022), and ends with their order of channels, and not with noise alone. likely: sorted weights (n, 675) -> the
        logits (n, 6) of ORDERS of their channels; None for all alike.
        """
        size = coordinates.into.shape[1]
        sigmas, clean = self.sampling_levels(), torch.zeros(n, size)
        if start is not None:
            fields, back = self.sorted(start[0])
            clean, level = coordinates.encode(fields), torch.tensor([start[1]])
            sigmas = torch.cat([level, sigmas[sigmas < level]])
        sigmas, clean = sigmas.to(device()), clean.to(device())
        samples = []
        for first in range(0, n, SAMPLE_BATCH):
            generator = torch_generator(seed, "sample", first, device=device())
            rows = slice(first, min(first + SAMPLE_BATCH, n))
            noise = torch.randn(rows.stop - first, size, generator=generator, device=device())
            x = clean[rows] + noise * sigmas[0]
            of_rows = functools.partial(denoise, rows=rows)
            x = SAMPLERS[self.sampler](of_rows, x, sigmas[:-1], generator)
            x = torch.lerp(of_rows(x, sigmas[-2]), x, self.state["share"].to(x))
            samples.append(coordinates.decode(x.cpu()))
        samples = torch.cat(samples)
        if start is not None:
            return reorder(samples, back)
        if not self.sort:
            return samples
        logits = likely(samples) if likely else torch.zeros(n, len(ORDERS))
        chosen = logits.softmax(1).multinomial(1, generator=torch_generator(seed, "order"))[:, 0]
        return reorder(samples, chosen)


@torch.no_grad()
def noisy_share(denoiser, data, sigma, generator):
    """Return (k,), within 0..1: the share of x = data + sigma noise that makes D(x) + share (x - D(x)) nearest to data
    (n, k), along each axis, by least squares.

    For D(x) = E[data | x] that is 0. A network that predicts the data is that precise at high levels only: near the
    lowest, where x says more than the network can tell, its own error takes part in every sample. Left out, samples
    lie a point farther from the training set by 1-NNA on BRDF-L1.
    """
    wanted, moved = torch.zeros(2, data.shape[1])
    for clean in data.split(SAMPLE_BATCH):
        x = clean + sigma * torch.randn(clean.shape, generator=generator)
        guess = denoiser(x.to(device()), sigma.to(device())).cpu()
        wanted += ((clean - guess) * (x - guess)).sum(0)
        moved += (x - guess).square().sum(0)
    return (wanted / moved).clamp(0, 1)
