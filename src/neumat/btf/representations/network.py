"""The network on top of the planes: forward and backward passes, written out.

Texels are in K rows of p: all texels of a column share one pair of directions. So the first layer's product with what
depends on directions is taken once a pair, `angular`, and added to every row. Everything is features-major, and in
blocks of rows that stay in a core's cache. No layer has a bias.
"""

import torch

BLOCK = 4096  # texels at a time
LOSSES = {"l1": torch.Tensor.sign_, "l2": torch.Tensor.clone, "huber": lambda error: error.clamp_(-0.05, 0.05)}


def forward(first, layers, plane, angular):
    """Return the outputs (3, n): plane (c, n), angular (width, n or 1), first (width, c), layers: the others."""
    x = first @ plane
    x.add_(angular)
    for layer in layers:
        x = layer @ x.relu_()
    return x


def gradients(first, layers, plane, angular, target, loss, block=BLOCK):
    """Return ([of first, of layers], of plane (c, K, p), of angular (width, p)): gradients of the summed loss.

    first (width, c), layers [(width, width), ..., (3, width)], plane (c, K, p), angular (width, p), target (3, K, p).
    loss: one of LOSSES of output minus target: the absolute value, half the square, or Huber's between them (0.05).
    """
    slope, masked = LOSSES[loss], torch.ops.aten.threshold_backward
    pairs = plane.shape[2]
    matrices = [first, *layers]
    found = [torch.zeros_like(matrix) for matrix in matrices]
    of_plane, of_angular = torch.empty_like(plane), torch.zeros_like(angular)
    rows = max(1, block // pairs)
    for start in range(0, plane.shape[1], rows):
        part = slice(start, start + rows)
        inputs = plane[:, part].flatten(1)
        hidden = [inputs]
        x = first @ inputs
        x.view(len(x), -1, pairs).add_(angular[:, None])
        for layer in layers:
            hidden.append(x.relu_())
            x = layer @ x
        back = slope(x.sub_(target[:, part].flatten(1)))
        for k in range(len(layers), 0, -1):
            found[k].addmm_(back, hidden[k].T)
            back = masked(matrices[k].T @ back, hidden[k], 0)
        found[0].addmm_(back, inputs.T)
        of_plane[:, part] = (first.T @ back).view(of_plane[:, part].shape)
        of_angular += back.view(len(back), -1, pairs).sum(1)
    return found, of_plane, of_angular
