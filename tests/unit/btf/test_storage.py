import pytest
import torch

from neumat.btf.representations.encoding import Encoding
from neumat.btf.representations.storage import packed, unpacked
from neumat.errors import NeumatError
from neumat.seeds import torch_generator


@pytest.fixture
def plane():
    return torch.randn(6, 5, 3, generator=torch_generator(0, "plane")) * torch.tensor([1.0, 0.01, 100.0]) + 7


@pytest.mark.parametrize(("bits", "error"), [(32, 0), (16, 2**-11), (8, 0.5 / 255)])
def test_planes_come_back_as_well_as_their_bits_allow(plane, bits, error):
    state = packed("plane", plane, bits)
    assert state["plane"].element_size() == bits // 8
    found = unpacked("plane", state)
    largest = plane.abs() if bits == 16 else plane.flatten(0, 1).amax(0) - plane.flatten(0, 1).amin(0)
    assert ((found - plane).abs() <= error * 1.001 * largest + 1e-6 * plane.abs()).all()


def test_a_constant_channel_survives_8_bits():
    assert torch.allclose(unpacked("plane", packed("plane", torch.full((4, 4, 2), 0.3), 8)), torch.tensor(0.3))


def test_other_bits_are_refused(plane):
    with pytest.raises(NeumatError, match="32, 16 or 8"):
        packed("plane", plane, 4)


@pytest.mark.parametrize("curve", [0.0, 1.0, 24.0])
def test_encoding_is_inverted_and_cuts_what_is_negative_or_too_bright(curve):
    encoding = Encoding(2.5, curve)
    values = torch.tensor([0.0, 1e-4, 0.1, 0.4, 3.0, 200.0])
    assert torch.allclose(encoding.decode(encoding.encode(values)), values, rtol=1e-4)
    assert encoding.encode(torch.tensor([0.4])).item() == pytest.approx(1, rel=1e-5)
    assert encoding.encode(torch.tensor([-0.4])).item() == 0
    cut = Encoding(2.5, curve, encoding.encode(torch.tensor([3.0])).item())
    assert torch.allclose(cut.decode(torch.tensor([-1.0, 1e6])), torch.tensor([0.0, 3.0]), rtol=1e-4)
