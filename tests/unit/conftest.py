"""Materials, encoders and sets that tests of several packages share."""

import math
import re

import pytest
import torch
from torch.nn.functional import interpolate, normalize

from neumat.fields.layout import SIZE, unpack
from neumat.metrics.materials import MaterialSet
from neumat.seeds import torch_generator


@pytest.fixture
def make_set():
    def make(n, seed=0, size=24, entries=64):
        """n random materials: pictures with a common flat border, values mostly small with a few high ones."""
        generator = torch.Generator().manual_seed(seed)
        brdf = torch.rand(n, entries, 3, generator=generator) ** 4 * 10
        images = torch.full((n, size, size, 3), 40, dtype=torch.uint8)
        inner = torch.randint(0, 256, (n, size // 4, size // 4, 3), generator=generator)
        inner = inner.repeat_interleave(2, 1).repeat_interleave(2, 2).to(torch.uint8)
        images[:, 6 : 6 + inner.shape[1], 6 : 6 + inner.shape[2]] = inner
        return MaterialSet(torch.arange(entries) * 37, brdf, images)

    return make


class Toy:
    """A text is the mean of its words' random vectors, an image a thumbnail."""

    id = "toy"
    WORDS = 64  # numbers of a text
    longest = 128

    def pieces(self, text):
        return [(*match.span(), True) for match in re.finditer(r"\S+", text)]

    def encode_text(self, texts):
        return normalize(torch.stack([torch.stack([self.word(w) for w in t.split()]).mean(0) for t in texts]))

    def encode_image(self, images):
        return interpolate(images.permute(0, 3, 1, 2).float() / 255, (4, 4), mode="area").flatten(1)

    @staticmethod
    def word(word):
        return torch.randn(Toy.WORDS, generator=torch_generator(0, word))


@pytest.fixture(scope="session")
def toy():
    """Return the class Toy, as `encoders.ENCODERS` holds classes."""
    return Toy


@pytest.fixture
def lambert():
    """Return a function: albedos, RGB or grey -> the weights (n, 675) of fields that reflect evenly, exactly."""

    def weights(*albedos):
        fields = torch.zeros(len(albedos), SIZE)
        fields[:, -3:] = torch.log1p(torch.tensor(albedos).view(len(albedos), -1) / torch.pi)
        return fields

    return weights


@pytest.fixture(scope="session")
def leaning():
    """Return a function: share -> weights (675,) with log(1 + f) = .1 (1 - share max(-d_y, 0)): evaluated with phi_d
    folded, d_y is never negative, and f the same everywhere."""

    def make(share):
        weights = torch.zeros(SIZE)
        (w1, _), (w2, _), (w3, b3) = unpack(weights)
        w1[4, 0], w2[0, 0], w3[0], b3[:] = -1.0, 1.0, -0.1 * share, 0.1
        return weights

    return make


# Highlight: height, 1/sr, and fall of log(1 + f) with sin theta_h; from matte to mirror.
HIGHLIGHTS = {
    "black": (0.0, 1.0),
    "matte": (0.05, 1.0),
    "rough": (0.3, 2.0),
    "satin": (1.0, 5.0),
    "eggshell": (3.0, 10.0),
    "plastic": (8.0, 20.0),
    "waxed": (20.0, 40.0),
    "glossy": (50.0, 80.0),
    "lacquer": (100.0, 150.0),
    "polished": (300.0, 300.0),
    "steel": (1000.0, 700.0),
    "mirror": (3000.0, 1500.0),
}


@pytest.fixture
def ladder(field):
    """{name: weights (675,)} of materials from matte to mirror, coloured where they are diffuse."""
    return {
        name: field((0.2, 0.1, 0.05) if name != "black" else 0.01, peak, fall)
        for name, (peak, fall) in HIGHLIGHTS.items()
    }


@pytest.fixture
def view():
    """A direction (3,) by its polar angle and azimuth."""

    def make(theta, phi=0.7):
        return torch.tensor([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])

    return make
