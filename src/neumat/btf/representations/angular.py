"""Planes of features over a square of directions: bilinear between nodes, the outermost on the square's border."""

import torch


def nodes(position, side):
    """Return (index int64 (4, p), weight (4, p)): the four nodes around each position (p, 2) in [0, 1]^2.

    Positions outside are moved to the border. The plane has side x side nodes, the first coordinate fastest.
    """
    scaled = position.clamp(0, 1).T * (side - 1)
    low = scaled.floor().clamp_max(side - 2)
    x, y = scaled - low
    column, row = low.long()
    corner = row * side + column
    index = torch.stack([corner, corner + 1, corner + side, corner + side + 1])
    return index, torch.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y])


def gather(plane, index, weight):
    """Return the features (c, p) of the plane (side^2, c) at `nodes`."""
    corners = plane.index_select(0, index.flatten()).view(*index.shape, -1)
    return (corners * weight[:, :, None]).sum(0).T


def scatter(gradient, index, weight, side):
    """Return the gradient (side^2, c) of the plane from that of its features (c, p): the transpose of `gather`."""
    channels = len(gradient)
    found = gradient.new_zeros(side * side * channels)
    place = index[:, :, None] * channels + torch.arange(channels)
    found.index_add_(0, place.flatten(), (gradient.T * weight[:, :, None]).flatten())
    return found.view(-1, channels)
