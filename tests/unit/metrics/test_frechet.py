import importlib.util

import pytest
import torch

from neumat.errors import NeumatError
from neumat.metrics import frechet as module
from neumat.metrics.frechet import features, frechet, kid

INSTALLED = importlib.util.find_spec("efficientnet_lite_pytorch") is not None


def gaussian(n, mean, std, seed):
    """Rows with exactly this mean and the sample covariance diag(std^2)."""
    x = torch.randn(n, len(mean), generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    x = torch.linalg.qr(x - x.mean(0)).Q * (n - 1) ** 0.5
    return x * torch.tensor(std, dtype=torch.float64) + torch.tensor(mean, dtype=torch.float64)


def test_frechet_of_known_gaussians():
    a = gaussian(50, [0, 0, 0], [1, 2, 3], 0)
    b = gaussian(80, [1, -2, 0], [2, 2, 1], 1)
    # |difference of means|^2 + sum of (s - s')^2 for commuting covariances.
    assert frechet(a, b) == pytest.approx(5 + 1 + 0 + 4, rel=1e-9)
    assert frechet(a, a) == pytest.approx(0, abs=1e-9)


def test_fewer_rows_than_features():
    # The same sets, padded with constant features, take the other branch and give the same distance.
    a, b = gaussian(50, [0, 0, 0], [1, 2, 3], 0), gaussian(80, [1, -2, 0], [2, 2, 1], 1)
    pad = torch.nn.functional.pad
    assert frechet(pad(a, (0, 200)), pad(b, (0, 200))) == pytest.approx(10, rel=1e-9)


def test_kid_is_unbiased():
    generator = torch.Generator().manual_seed(0)
    sets = [torch.randn(40, 6, generator=generator) for _ in range(60)]
    values = torch.tensor([kid(a, b) for a, b in zip(sets[::2], sets[1::2], strict=True)])
    assert values.mean().abs() < 3 * values.std() / len(values) ** 0.5
    assert kid(sets[0], sets[1] + 1) > values.max()


def test_missing_package_is_one_line(monkeypatch):
    module._network.cache_clear()
    monkeypatch.setitem(__import__("sys").modules, "efficientnet_lite_pytorch", None)
    with pytest.raises(NeumatError, match="EfficientNet-Lite0"):
        features(torch.zeros(1, 8, 8, 3, dtype=torch.uint8))


@pytest.mark.skipif(not INSTALLED, reason="the packages of EfficientNet-Lite0 are not installed")
def test_features_do_not_depend_on_the_batch(make_set):
    images = make_set(3).images
    rows = features(images, batch=2)
    assert rows.shape == (3, 1280) and torch.isfinite(rows).all()
    assert torch.allclose(rows[2:], features(images[2:]), atol=1e-4)
    assert not torch.allclose(rows[0], rows[1], atol=1e-2)
