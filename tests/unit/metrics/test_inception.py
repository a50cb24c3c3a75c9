import pytest
import torch
from torch import nn

from neumat.errors import NeumatError
from neumat.metrics.inception import features, read_weights

SHAPES = {"Conv2d_1a_3x3": (32, 3), "Conv2d_2a_3x3": (32, 32), "Conv2d_2b_3x3": (64, 32)}


@pytest.fixture
def state():
    """Random weights by the names and shapes of pytorch-fid's file, and some of those that come after."""
    generator = torch.Generator().manual_seed(0)
    found = {"Mixed_5b.branch1x1.conv.weight": torch.zeros(64, 192, 1, 1), "fc.bias": torch.zeros(1008)}
    for layer, (out, into) in SHAPES.items():
        found[f"{layer}.conv.weight"] = torch.randn(out, into, 3, 3, generator=generator) / (9 * into) ** 0.5
        for name in ("weight", "running_var"):
            found[f"{layer}.bn.{name}"] = 0.5 + torch.rand(out, generator=generator)
        for name in ("bias", "running_mean"):
            found[f"{layer}.bn.{name}"] = 0.3 * torch.randn(out, generator=generator)
        found[f"{layer}.bn.num_batches_tracked"] = torch.tensor(0)
    return found


@pytest.fixture
def saved(tmp_path):
    def save(content):
        torch.save(content, tmp_path / "inception.pth")
        return tmp_path / "inception.pth"

    return save


def block(state, layer, **options):
    out, into = SHAPES[layer]
    conv, norm = nn.Conv2d(into, out, 3, bias=False, **options), nn.BatchNorm2d(out, eps=0.001)
    for part, module in (("conv", conv), ("bn", norm)):
        start = f"{layer}.{part}."
        module.load_state_dict({k.removeprefix(start): v for k, v in state.items() if k.startswith(start)})
    return [conv, norm, nn.ReLU()]


def test_features_are_those_of_the_layers_built_one_by_one(state, saved, make_set):
    network = nn.Sequential(
        nn.Upsample((299, 299), mode="bilinear"),
        *block(state, "Conv2d_1a_3x3", stride=2),
        *block(state, "Conv2d_2a_3x3"),
        *block(state, "Conv2d_2b_3x3", padding=1),
        nn.MaxPool2d(3, stride=2),
        nn.AdaptiveAvgPool2d(1),
        nn.Flatten(),
    ).eval()
    images = make_set(3, size=64).images
    rows = features(images, read_weights(saved(state)), batch=2)
    with torch.no_grad():
        expected = network(images.permute(0, 3, 1, 2) / 127.5 - 1)
    assert rows.shape == (3, 64) and rows.std(0).max() > 1e-3
    assert torch.allclose(rows, expected, atol=1e-5)


def test_one_filter_hands_red_through(saved, state):
    # Each layer passes its first channel on: by its middle tap, and a norm that only divides by sqrt(1 + 0.001).
    for layer in SHAPES:
        state[f"{layer}.conv.weight"].zero_()[0, 0, 1, 1] = 1
        for name, value in (("weight", 1), ("bias", 0), ("running_mean", 0), ("running_var", 1)):
            state[f"{layer}.bn.{name}"].fill_(value)
    images = torch.tensor([[204, 9, 9], [51, 9, 9]], dtype=torch.uint8)[:, None, None].repeat(1, 40, 30, 1)
    rows = features(images, read_weights(saved(state)))
    assert rows[0, 0].item() == pytest.approx(0.6 / 1.001**1.5, rel=1e-5)  # 204 / 255 on the scale from -1 to 1
    assert rows[0, 1:].abs().max() == rows[1].abs().max() == 0  # 51 / 255 is -0.6 there, which ReLU stops


def test_other_files_end_in_one_line(state, saved, tmp_path):
    (tmp_path / "text.pth").write_text("<html>404</html>")
    (tmp_path / "empty.pth").touch()
    for path in (tmp_path / "absent.pth", tmp_path / "text.pth", tmp_path / "empty.pth", tmp_path):
        with pytest.raises(NeumatError, match=f"{path}: expected a state dict.*; found") as error:
            read_weights(path)
        assert "\n" not in str(error.value)
    for content in (torch.zeros(3), [1, 2], nn.Linear(2, 2)):
        with pytest.raises(NeumatError, match=r"inception\.pth: expected") as error:
            read_weights(saved(content))
        assert "\n" not in str(error.value)
    key = "Conv2d_2b_3x3.bn.running_var"
    for change, found in (({key: torch.ones(32)}, r"\(32,\)"), ({key: 1.0}, "none")):
        with pytest.raises(NeumatError, match=rf"{key} of shape \(64,\); found {found}"):
            read_weights(saved(state | change))
    del state[key]
    with pytest.raises(NeumatError, match=rf"{key} of shape \(64,\); found none"):
        read_weights(saved(state))
