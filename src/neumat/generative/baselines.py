"""The paper's baselines and the null baselines that a novel-looking score has to beat."""

from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

import torch
from torch import nn

from neumat.fields.layout import SIZE
from neumat.generative.base import GenerativeModel
from neumat.generative.hyperdiffusion import HyperDiffusion
from neumat.generative.training import device, seeded, train
from neumat.seeds import torch_generator


class Span:
    """Orthonormal coordinates of tables that are combinations of m columns with Gram matrix G.

    encode: coefficients (n, 3, m) -> (n, 3 r), where squared distances are those of the tables; decode: back. With
    G = V diag(l) V^T the coordinates of a channel c are c V sqrt(l), over the r eigenvalues above 1e-10 of the
    largest (below that float64 sums of float16 columns are noise).
    """

    def __init__(self, gram):
        values, axes = torch.linalg.eigh(torch.as_tensor(gram, dtype=torch.float64))
        kept = values > 1e-10 * values[-1]
        root = values[kept].sqrt()
        self.into = axes[:, kept] * root
        self.back = (axes[:, kept] / root).T

    def encode(self, coefficients):
        return (torch.as_tensor(coefficients).double() @ self.into).flatten(1)

    def decode(self, coordinates):
        return coordinates.double().unflatten(1, (3, -1)) @ self.back


def gaussian_pca(data, components):
    """Return {mean (k,), axes (r, k)} of data (n, k), float64; each axis as long as its standard deviation."""
    mean = data.mean(0)
    _, singular, axes = torch.linalg.svd(data - mean, full_matrices=False)
    return {"mean": mean, "axes": (axes * singular[:, None] / len(data) ** 0.5)[:components]}


def draw_gaussian(state, n, seed):
    """Return (n, k) float64 samples of the Gaussian that `gaussian_pca` fitted."""
    normal = torch.randn(n, len(state["axes"]), generator=torch_generator(seed, "sample"), dtype=torch.float64)
    return normal @ state["axes"] + state["mean"]


@dataclass(kw_only=True)
class PcaA(GenerativeModel):
    """PCA of the tables with a Gaussian on its components (M3ashy's PCA-A)."""

    kind = "table"
    components: int = 300

    def _fit(self, dataset, seed, progress, checkpoint):
        span = Span(dataset.gram)
        state = gaussian_pca(span.encode(dataset.coefficients), self.components)
        return {name: span.decode(value.reshape(-1, value.shape[-1])) for name, value in state.items()}

    def _sample(self, n, seed):
        # Axes and mean are kept as coefficients: a sample is a combination of them.
        flat = {"mean": self.state["mean"].flatten(), "axes": self.state["axes"].flatten(1)}
        return draw_gaussian(flat, n, seed).unflatten(1, (3, -1)).numpy()


@dataclass(kw_only=True)
class PcaN(GenerativeModel):
    """PCA of the weight vectors with a Gaussian on its components (M3ashy's PCA-N)."""

    components: int = 100

    def _fit(self, dataset, seed, progress, checkpoint):
        return gaussian_pca(dataset.weights.double(), self.components)

    def _sample(self, n, seed):
        return draw_gaussian(self.state, n, seed).numpy()


class VaeNetwork(nn.Module):
    """Variational autoencoder (Kingma & Welling 2014): ReLU multilayer perceptrons, Gaussian latent."""

    def __init__(self, size, hidden, latent, layers):
        super().__init__()
        widths = [size] + [hidden] * (layers - 1)
        self.encoder = self.mlp([*widths, 2 * latent])
        self.decoder = self.mlp([latent, *reversed(widths)])

    @staticmethod
    def mlp(widths):
        layers = []
        for a, b in pairwise(widths):
            layers += [nn.Linear(a, b), nn.ReLU()]
        return nn.Sequential(*layers[:-1])

    def loss(self, x, noise, beta):
        """Return squared error + beta KL divergence per example: x (n, size), noise (n, latent)."""
        mean, log_variance = self.encoder(x).chunk(2, -1)
        log_variance = log_variance.clamp(-20, 20)
        error = (self.decoder(mean + noise * (log_variance / 2).exp()) - x).square().sum(-1)
        divergence = (mean.square() + log_variance.exp() - 1 - log_variance).sum(-1) / 2
        return (error + beta * divergence).mean()


@dataclass(kw_only=True)
class Vae(GenerativeModel):
    """A VAE on numbers that a subclass makes from the dataset. beta: weight of the divergence."""

    hidden: int = 300
    latent: int = 300
    layers: int = 4
    beta: float = 1.0
    steps: int = 3000
    batch: int = 128
    lr: float = 1e-3

    def _network(self, size, seed=0):
        with seeded(seed, "initial weights"):
            return VaeNetwork(size, self.hidden, self.latent, self.layers)

    def _train(self, data, seed, progress, checkpoint):
        """Return the fitted state of data (n, size), which is centred and brought to mean square 1."""
        mean = data.mean(0)
        scale = (data - mean).square().mean().sqrt()
        x = ((data - mean) / scale).float()
        network = self._network(x.shape[1], seed).to(device())

        def loss(generator):
            rows = torch.randint(len(x), (self.batch,), generator=generator)
            noise = torch.randn(self.batch, self.latent, generator=generator)
            return network.loss(x[rows].to(device()), noise.to(device()), self.beta)

        train(
            network, loss, steps=self.steps, lr=self.lr, precision="float32", seed=seed, progress=progress,
            checkpoint=checkpoint and Path(checkpoint), identity=asdict(self),
        )  # fmt: skip
        weights = {f"network.{name}": value.cpu() for name, value in network.state_dict().items()}
        return {"mean": mean, "scale": scale, **weights}

    @torch.no_grad()
    def _draw(self, n, seed):
        """Return (n, size) float64 numbers decoded from the prior."""
        network = self._network(len(self.state["mean"]))
        prefix = "network."
        network.load_state_dict({k.removeprefix(prefix): v for k, v in self.state.items() if k.startswith(prefix)})
        latent = torch.randn(n, self.latent, generator=torch_generator(seed, "sample"))
        return network.decoder(latent).double() * self.state["scale"] + self.state["mean"]


@dataclass(kw_only=True)
class VaeN(Vae):
    """VAE of the weight vectors (M3ashy's VAE-N)."""

    def _fit(self, dataset, seed, progress, checkpoint):
        return self._train(dataset.weights.double(), seed, progress, checkpoint)

    def _sample(self, n, seed):
        return self._draw(n, seed).numpy()


@dataclass(kw_only=True)
class VaeA(Vae):
    """VAE of the tables at half resolution (M3ashy's VAE-A), trained in an orthonormal basis of their span.

    Squared error there is squared error between the tables, so neither the loss nor its optimum changes.
    """

    kind = "table"
    stride = 2
    hidden: int = 256
    layers: int = 2

    def _fit(self, dataset, seed, progress, checkpoint):
        span = Span(dataset.gram)
        state = self._train(span.encode(dataset.coefficients), seed, progress, checkpoint)
        return {**state, "back": span.back}

    def _sample(self, n, seed):
        return (self._draw(n, seed).unflatten(1, (3, -1)) @ self.state["back"]).numpy()


@dataclass(kw_only=True)
class Merl100(HyperDiffusion):
    """HyperDiffusion on the measured materials alone, before any augmentation (M3ashy's MERL100), not even `mixing`."""

    def __post_init__(self):
        super().__post_init__()
        self.mixing = None

    def _fit(self, dataset, seed, progress, checkpoint):
        measured = dataset.subset(dataset.is_source & (dataset.permutation == 0))
        return super()._fit(measured, seed, progress, checkpoint)


@dataclass(kw_only=True)
class Training(GenerativeModel):
    """What the null baselines share: they keep the training weights."""

    def _fit(self, dataset, seed, progress, checkpoint):
        return {"weights": dataset.weights.float()}

    def _rows(self, n, seed):
        return torch.randint(len(self.state["weights"]), (n,), generator=torch_generator(seed, "rows"))


@dataclass(kw_only=True)
class Copies(Training):
    """Training materials drawn with replacement: what pure memory scores."""

    def _sample(self, n, seed):
        return self.state["weights"][self._rows(n, seed)].numpy()


@dataclass(kw_only=True)
class NoisyCopies(Training):
    """Copies with Gaussian noise of `noise` times each weight's standard deviation."""

    noise: float = 0.05

    def _sample(self, n, seed):
        weights = self.state["weights"]
        jitter = torch.randn(n, SIZE, generator=torch_generator(seed, "noise")) * weights.std(0)
        return (weights[self._rows(n, seed)] + self.noise * jitter).numpy()


@dataclass(kw_only=True)
class Interpolations(Training):
    """Linear interpolations of pairs of training weight vectors, weight uniform in 0..1."""

    def _sample(self, n, seed):
        weights, share = self.state["weights"], torch.rand(n, 1, generator=torch_generator(seed, "share"))
        return torch.lerp(weights[self._rows(n, seed)], weights[self._rows(n, f"{seed}/second")], share).numpy()
