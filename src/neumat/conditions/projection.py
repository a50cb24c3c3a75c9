"""One space for texts and images: a projection of both encoders' features, trained on captions and renders.

Texts pass through the projection augmentation of CLIP-PAE (Zhou et al. 2023) first: they are projected onto the space
that a corpus of material captions spans, which drops what a text says beside materials, and what is left is amplified.
"""

import torch
from torch import nn
from torch.nn.functional import cross_entropy, normalize

from neumat.errors import NeumatError
from neumat.generative.training import device, seeded, train

SIZE = 128
HIDDEN = 256
TEMPERATURE = 0.07
KEPT = 0.98  # of the captions' variance lies in the space that texts are projected onto


class Augmentation:
    """Projection augmentation: e -> mean + (1 + power) P (e - mean), normalised; P projects onto the captions' space.

    power < 0 switches it off: texts stay as encoded. At 0 they are projected only.
    """

    def __init__(self, mean, axes, power):
        self.mean, self.axes, self.power = mean, axes, power

    @classmethod
    def fit(cls, captions, power):
        """Return the Augmentation whose space holds KEPT of the variance of encoded captions (n, t)."""
        mean = captions.mean(0)
        _, singular, axes = torch.linalg.svd((captions - mean).double(), full_matrices=False)
        share = (singular**2).cumsum(0) / (singular**2).sum()
        return cls(mean, axes[: int((share < KEPT).sum()) + 1].float().contiguous(), power)

    def __call__(self, texts):
        """Return encoded texts (n, t), augmented."""
        if self.power < 0:
            return texts
        inside = (texts - self.mean) @ self.axes.T @ self.axes
        return normalize(self.mean + (1 + self.power) * inside)


def network(size):
    """Return the network of one encoder's features: (n, size) -> (n, SIZE), before normalisation."""
    return nn.Sequential(nn.Linear(size, HIDDEN), nn.SiLU(), nn.Dropout(0.1), nn.Linear(HIDDEN, SIZE))


class Projection:
    """Texts and images in one space of SIZE numbers on the unit sphere.

    encoder: the id of the encoder whose features it takes.
    """

    def __init__(self, encoder, state):
        self.encoder, self.state = encoder, state
        self.augmentation = Augmentation(state["mean"], state["axes"], float(state["power"]))
        self.networks = {}
        for side in ("text", "image"):
            weights = {k.removeprefix(f"{side}."): v for k, v in state.items() if k.startswith(f"{side}.")}
            self.networks[side] = network(weights["0.weight"].shape[1])
            self.networks[side].load_state_dict(weights)
            self.networks[side].eval()

    @classmethod
    def fit(cls, encoder, texts, images, power, steps, batch, seed, progress):
        """Return the Projection trained by contrast (Radford et al. 2021): each picture against the captions of its
        material and against another picture of it, among `batch` materials a step.

        texts (n, p, t), images (n, a, i): p captions and a pictures of each of n materials, encoded.
        """
        augmentation = Augmentation.fit(texts.flatten(0, 1), power)
        texts = augmentation(texts.flatten(0, 1)).view_as(texts)
        on = device()
        with seeded(seed, "projection"):
            both = nn.ModuleDict({"text": network(texts.shape[2]), "image": network(images.shape[2])}).to(on)
        batch = min(batch, len(texts))
        caption = texts.flatten(0, 1).unique(dim=0, return_inverse=True)[1].view(texts.shape[:2])

        def loss(generator):
            rows = torch.randperm(len(texts), generator=generator)[:batch]
            p = torch.randint(texts.shape[1], (batch,), generator=generator)
            a, b = torch.randint(images.shape[1], (2, batch), generator=generator)
            # Materials that share the caption are no counterexamples of each other.
            same = (caption[rows, p][:, None] == caption[rows, p]).to(on, torch.float32)
            said = normalize(both["text"](texts[rows, p].to(on)))
            seen, again = (normalize(both["image"](images[rows, k].to(on))) for k in (a, b))
            target = same / same.sum(1, keepdim=True)
            itself = torch.arange(batch, device=on)
            return (
                cross_entropy(seen @ said.T / TEMPERATURE, target)
                + cross_entropy(said @ seen.T / TEMPERATURE, target)
                + cross_entropy(seen @ again.T / TEMPERATURE, itself)
            )

        train(both, loss, steps=steps, lr=1e-3, weight_decay=0.01, seed=seed, progress=progress, checkpoint=None,
              identity=None)  # fmt: skip
        state = {name: value.cpu() for name, value in both.state_dict().items()}
        power = torch.tensor(float(power))
        return cls(encoder, {"mean": augmentation.mean, "axes": augmentation.axes, "power": power} | state)

    @torch.no_grad()
    def text(self, features):
        """Return encoded texts (..., t) in the common space, (..., SIZE)."""
        return normalize(self.networks["text"](self.augmentation(features)), dim=-1)

    @torch.no_grad()
    def image(self, features):
        """Return encoded images (..., i) in the common space, (..., SIZE). Raises NeumatError for a wrong size."""
        expected = self.networks["image"][0].in_features
        if features.shape[-1] != expected:
            raise NeumatError("image features", f"{expected} numbers of {self.encoder}", features.shape[-1])
        return normalize(self.networks["image"](features), dim=-1)
