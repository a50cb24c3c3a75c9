"""The 64 features of M3ashy's published FID: those of pytorch-fid's `--dims 64`, on the file of its weights.

They are the channel means behind the first max-pool of the Inception network of Heusel et al. 2017. No package holds
the weights: users download pytorch-fid's `pt_inception-2015-12-05-6726825d.pth` themselves.
"""

import torch
from torch.nn import functional

from neumat.errors import NeumatError

NAME = "Inception64"
SIZE = 299  # the network's own width and height, pixels
# Three convolutions of 3 x 3, each with a batch norm and a ReLU: channels in, channels out, stride, padding.
LAYERS = {"Conv2d_1a_3x3": (3, 32, 2, 0), "Conv2d_2a_3x3": (32, 32, 1, 0), "Conv2d_2b_3x3": (32, 64, 1, 1)}
NORM = ("running_mean", "running_var", "weight", "bias")


def read_weights(path):
    """Return the weights of LAYERS, {name: float32 tensor}, from pytorch-fid's file, a state dict of the network.

    Raises NeumatError where it is no state dict, or lacks a weight, or holds one of another shape.
    """
    try:
        state = dict(torch.load(path, map_location="cpu", weights_only=True))
    except Exception as error:  # what the bytes of another file raise depends on the bytes
        raise NeumatError(path, "a state dict saved by PyTorch", type(error).__name__) from error
    weights = {}
    for layer, (into, out, _, _) in LAYERS.items():
        shapes = {"conv.weight": (out, into, 3, 3)} | {f"bn.{name}": (out,) for name in NORM}
        for name, shape in shapes.items():
            key = f"{layer}.{name}"
            found = tuple(state[key].shape) if torch.is_tensor(state.get(key)) else "none"
            if found != shape:
                raise NeumatError(path, f"{key} of shape {shape}", found)
            weights[key] = state[key].float()
    return weights


@torch.inference_mode()
def features(images, weights, batch=8):
    """Return the 64 features, float32 (n, 64), of uint8 sRGB pictures (n, H, W, 3); weights: see read_weights.

    As in pytorch-fid: resized bilinearly without antialiasing, corners not aligned, values from -1 to 1.
    """
    rows = []
    for part in images.split(batch):
        x = part.permute(0, 3, 1, 2).float() / 255
        x = 2 * functional.interpolate(x, (SIZE, SIZE), mode="bilinear", align_corners=False) - 1
        for layer, (_, _, stride, padding) in LAYERS.items():
            x = functional.conv2d(x, weights[f"{layer}.conv.weight"], stride=stride, padding=padding)
            x = functional.batch_norm(x, *(weights[f"{layer}.bn.{name}"] for name in NORM), eps=1e-3).relu()
        rows.append(functional.max_pool2d(x, 3, 2).mean((2, 3)))
    return torch.cat(rows)
