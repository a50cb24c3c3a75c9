import torch

from neumat.btf.synthesis.hex import Hex
from neumat.btf.synthesis.linear import Linear
from neumat.seeds import torch_generator


def test_weights_are_sharper_than_linear_ones():
    plane = torch.randn(64, 64, 2, generator=torch_generator(1))
    texel = torch.randint(0, 6400, (50_000, 2), generator=torch_generator(2))
    u = (texel.double() + 0.5) / 64
    sharp, linear = (method(plane, 1, True).at(u).var(0).sum() / plane.var((0, 1)).sum() for method in (Hex, Linear))
    assert 0.7 < sharp < 1 and 0.45 < linear < 0.55


def test_bright_features_win():
    plane = torch.rand(64, 64, 1, generator=torch_generator(3))
    texel = torch.randint(0, 6400, (50_000, 2), generator=torch_generator(4))
    features = Hex(plane, 1, True).at((texel.double() + 0.5) / 64)
    assert features.mean() > plane.mean() + 0.01
