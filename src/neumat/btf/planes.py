"""Planes of features (H, W, c): bilinear fetches, weighted sums of fetches, and levels of detail.

A plane covers the unit square: texel (i, j) has its centre at ((j + 1/2) / W, (i + 1/2) / H).
"""

import torch


def fetch(plane, u, wrap):
    """Return features (n, c) of a `plane` (H, W, c) at positions `u` (n, 2), bilinear between the centres of texels.

    wrap: whether the plane repeats; else positions beyond the outer texels' centres get the outer texels. Each row of
    the result depends on its row of `u` only, to the bit. A position that is NaN gives NaN.
    """
    return blend(plane, u[:, None], torch.ones(len(u), 1, device=u.device), wrap)


def blend(plane, u, weights, wrap):
    """Return the sums (n, c) of k fetches of a `plane` at positions `u` (n, k, 2), times `weights` (n, k), float32."""
    height, width, channels = plane.shape
    (left, right, x), (top, bottom, y) = _taps(u[..., 0], width, wrap), _taps(u[..., 1], height, wrap)
    top, bottom = top * width, bottom * width
    index = torch.stack([top + left, top + right, bottom + left, bottom + right], -1)
    upper, lower = weights * (1 - y), weights * y
    taps = torch.stack([upper * (1 - x), upper * x, lower * (1 - x), lower * x], -1)
    # One kernel sums the rows of each query in their order, whatever the other queries are.
    return torch.nn.functional.embedding_bag(
        index.flatten(1), plane.reshape(-1, channels), mode="sum", per_sample_weights=taps.flatten(1)
    )


def prefilter(plane):
    """Return the levels of detail of a `plane` (H, W, c): itself, means over 2 x 2 texels, and so on down to 1 x 1.

    An odd size is halved and rounded up, each texel the mean over its exact footprint, so that all levels have the same
    mean. A constant plane stays so exactly.
    """
    base = plane[:1, :1]
    levels = [plane - base]
    while levels[-1].shape[:2] != (1, 1):
        levels.append(_halved(_halved(levels[-1]).transpose(0, 1)).transpose(0, 1).contiguous())
    return [plane, *(level + base for level in levels[1:])]


def level_sizes(height, width):
    """Return the sizes [(height, width), ..., (1, 1)] of the levels of detail of a plane."""
    top = max(height - 1, width - 1).bit_length()
    return [(-(-height // 2**k), -(-width // 2**k)) for k in range(top + 1)]


def means(plane):
    """Return the texels (n, c) of all levels of detail of a `plane` (H, W, c) below the first, level by level."""
    return torch.cat([plane.new_empty(0, plane.shape[2]), *(level.flatten(0, 1) for level in prefilter(plane)[1:])])


def in_levels(rows, size):
    """Return texels (n, c), in the order of `means`, as the levels of a plane of `size` (H, W), without the first."""
    sizes = level_sizes(*size)[1:]
    parts = rows.split([height * width for height, width in sizes])
    return [part.reshape(*one, -1) for part, one in zip(parts, sizes, strict=True)]


def _taps(u, size, wrap):
    """Return the two texels, int64, between whose centres each position lies, and its place from one to the other."""
    x = u * size - 0.5
    first = torch.floor(x)
    place = (x - first).float()
    first = first.long()
    second = first + 1
    if wrap:
        return first.remainder(size), second.remainder(size), place
    return first.clamp(0, size - 1), second.clamp(0, size - 1), place


def _halved(plane):
    """Return the rows of a plane averaged over footprints, ceil(H / 2) of them."""
    height = len(plane)
    if height % 2 == 0:
        return plane.unflatten(0, (-1, 2)).mean(1)
    edges = torch.linspace(0, height, (height + 1) // 2 + 1, dtype=torch.float64, device=plane.device)
    texel = torch.arange(height, dtype=torch.float64, device=plane.device)
    overlap = torch.minimum(edges[1:, None], texel + 1) - torch.maximum(edges[:-1, None], texel)
    overlap = (overlap.clamp_min(0) / (edges[1] - edges[0])).to(plane.dtype)
    return torch.einsum("ij,jkc->ikc", overlap, plane)
