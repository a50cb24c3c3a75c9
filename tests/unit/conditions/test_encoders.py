import builtins

import pytest
import torch

from neumat.conditions.encoders import Packaged, encoder_of, make_encoder
from neumat.errors import NeumatError


def test_packaged_features_tell_words_and_colours_apart():
    encoder = make_encoder("packaged")
    a, b, c = encoder.encode_text(["shiny red plastic", "a glossy red plastic", "grey felt"])
    assert a @ b > 0.8 > a @ c
    even = torch.tensor([[200, 30, 30], [190, 40, 40], [30, 30, 200]], dtype=torch.uint8)
    features = encoder.encode_image(even[:, None, None].expand(-1, 64, 64, 3))
    assert features.shape == (3, 1280 + 48)
    assert torch.dist(features[0], features[1]) < torch.dist(features[0], features[2])


def test_a_checkpoint_finds_its_encoder_by_id():
    assert isinstance(encoder_of(Packaged.id), Packaged)
    for find in (encoder_of, make_encoder):
        with pytest.raises(NeumatError, match="expected one of"):
            find("no such encoder")


def test_a_missing_package_ends_in_one_line(monkeypatch):
    real = builtins.__import__

    def without(name, *rest):
        if name.startswith("open_clip"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(NeumatError, match="open_clip_torch and its weights"):
        make_encoder("open-clip").encode_text(["red"])
