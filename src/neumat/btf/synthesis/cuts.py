"""Patches that fit to what they overlap, and the cuts along which they are joined (Efros and Freeman 2001)."""

import torch

COMPONENTS = 3  # principal components of the features on which errors are taken
TOLERANCE = 1.15  # a patch may be this much worse than the best


def comparable(plane):
    """Return the first principal components (k, H, W) of a `plane` (H, W, c), scaled to a variance of 1 in all."""
    rows = plane.flatten(0, 1)
    rows = rows - rows.mean(0)
    _, vectors = torch.linalg.eigh((rows.T @ rows).double())
    components = rows @ vectors[:, -COMPONENTS:].to(rows.dtype)
    scale = components.square().sum(1).mean().sqrt().clamp_min(1e-12)
    return (components / scale).T.reshape(-1, *plane.shape[:2])


def mismatches(features, targets, known):
    """Return the sums of squared differences (n, H - h + 1, W - w + 1) of each `targets` (n, k, h, w) from the patches
    of `features` (k, H, W) whose first texel is at each position, over the texels `known` (h, w)."""
    size = features.shape[1:]
    known = known.to(features.dtype)
    energy = torch.fft.rfft2(features.square().sum(0)) * torch.fft.rfft2(known, size).conj()
    shared = (torch.fft.rfft2(features) * torch.fft.rfft2(targets * known, size).conj()).sum(1)
    errors = torch.fft.irfft2(energy - 2 * shared, size) + (targets.square().sum(1) * known).sum((1, 2))[:, None, None]
    return errors[:, : size[0] - targets.shape[2] + 1, : size[1] - targets.shape[3] + 1].clamp_min(0)


def fitting(errors, generator, room=None):
    """Return positions (n, 2), row and column, drawn among those whose `errors` (n, H, W) are nearly the least, where
    there is `room` (H, W)."""
    if room is not None:
        errors = torch.where(room, errors, errors.amax() + 1)
    flat = errors.flatten(1).cpu()
    limit = TOLERANCE * flat.amin(1, keepdim=True) + 1e-3 * flat.mean(1, keepdim=True) + 1e-12
    draws = torch.rand(flat.shape, generator=generator)
    chosen = torch.where(flat <= limit, draws, -1.0).argmax(1)
    return torch.stack([chosen // errors.shape[2], chosen % errors.shape[2]], 1).to(errors.device)


def minimum_cut(errors):
    """Return the column (n, L), int64, in each row of the path of the least sum of `errors` (n, L, w) from the first
    row to the last; the column changes by at most 1 from one row to the next."""
    sums = [errors[:, 0]]
    steps = []
    for row in errors.unbind(1)[1:]:
        before = torch.nn.functional.pad(sums[-1], (1, 1), value=torch.inf).unfold(1, 3, 1)
        least, step = before.min(2)
        sums.append(row + least)
        steps.append(step - 1)
    column = sums[-1].argmin(1)
    path = [column]
    for step in reversed(steps):
        column = column + step.gather(1, column[:, None])[:, 0]
        path.append(column)
    return torch.stack(path[::-1], 1)


def beyond_cut(errors, band, dimension, flip):
    """Return the texels (n, h, w) beyond the least-error cut through a band, `band` texels wide, along a border of
    `errors` (n, h, w): the first rows (dimension 1) or columns (dimension 2), or with `flip` the last ones."""
    turned = errors if dimension == 2 else errors.transpose(1, 2)
    turned = turned.flip(2) if flip else turned
    path = minimum_cut(turned[..., :band])
    beyond = torch.arange(turned.shape[2], device=errors.device) > path[..., None]
    beyond = beyond.flip(2) if flip else beyond
    return beyond if dimension == 2 else beyond.transpose(1, 2)
