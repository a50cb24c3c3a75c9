"""An encoder that takes no time; fields that reflect evenly."""

import pytest
import torch
from torch.nn.functional import interpolate, normalize

from neumat.fields.layout import SIZE
from neumat.seeds import torch_generator


class Toy:
    """A text is the mean of its words' random vectors, an image a thumbnail."""

    id = "toy"
    WORDS = 64  # numbers of a text

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
