"""An encoder that takes no time."""

import pytest
import torch
from torch.nn.functional import interpolate, normalize

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
