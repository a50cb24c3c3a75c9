"""Structural similarity of every picture of a set with every other.

Every factor of SSIM (Wang et al. 2004; M3ashy, equations 25 to 34 with a = b = c = 1) is an inner product between
something that depends on the first picture only and something that depends on the second only. So the whole
table is three batched matrix products per window and one division, and each picture's statistics are taken once.
"""

import math

import torch

C1 = 0.01**2  # k1 = 0.01, k2 = 0.03, pictures scaled to [0, 1]
C2 = 0.03**2
_WINDOWS = 16  # windows at a time, and
_ROWS = 64  # rows of the table at a time: the working set fits a core's L2 cache


def pairwise_ssim(images, window=3, step=13):
    """Return the mean SSIM of every two pictures, a symmetric float64 tensor (n, n).

    images: uint8 tensor (n, H, W, 3).

    The mean is over the channels and over the uniform `window` x `window` windows inside the picture. With step 1
    it equals skimage's structural_similarity(win_size=window, channel_axis=-1, data_range=255); window 3 is the
    released M3ashy code's. Windows in which all pictures agree, such as the background, have SSIM 1 and are counted
    without being computed; of the others every `step`-th is taken, row by row and channel by channel.
    On the sphere pictures of 240 MERL fields, step 13 is off by 2e-4 on average and 1e-3 at most.
    """
    pixels = images.flatten(1).T.contiguous()  # (H W 3, n)
    windows, inside = _windows(images, window)
    chosen = windows[::step]
    n = len(images)
    total = torch.zeros(n, n, dtype=torch.float64)
    for chunk in chosen.split(_WINDOWS):
        structure, luminance, left, right = _factors(pixels[chunk].float() / 255)
        for row in range(0, n, _ROWS):
            rows, columns = slice(row, row + _ROWS), slice(row, n)
            value = torch.bmm(luminance[:, :, rows].mT, luminance[:, :, columns])
            value *= torch.bmm(structure[:, :, rows].mT, structure[:, :, columns])
            value /= torch.bmm(left[:, :, rows].mT, right[:, :, columns])
            total[rows, columns] += value.sum(0)
    upper = total.triu(1)
    share = len(windows) / inside
    result = (upper + upper.T) * (share / max(len(chosen), 1)) + (1 - share)
    return result.fill_diagonal_(1.0)


def _windows(images, window):
    """Return the flat pixel indices (windows, window^2) of the windows in which pictures differ, each channel apart,
    and the number of all windows inside the picture."""
    differs = (images != images[:1]).any(0).permute(2, 0, 1)  # (3, H, W)
    active = torch.nn.functional.max_pool2d(differs.float(), window, stride=1) > 0
    channel, y, x = active.nonzero(as_tuple=True)
    width = differs.shape[2]
    offset = torch.arange(window)
    offset = (offset[:, None] * width + offset).flatten() * 3
    return ((y * width + x) * 3 + channel)[:, None] + offset, active.numel()


def _factors(x):
    """Return the factors of SSIM of windows x (P, window^2, n): (2 cov + C2) and (2 mu mu' + C1) are products of the
    first two with themselves, the denominator (p + p')(q + q') is the product of the last two."""
    mean = x.mean(1, keepdim=True)
    centred = x - mean
    samples = x.shape[1] - 1
    p = mean.square() + C1 / 2
    q = centred.square().sum(1, keepdim=True) / samples + C2 / 2
    one = torch.ones_like(mean)
    structure = torch.cat([centred * math.sqrt(2 / samples), one * math.sqrt(C2)], 1)
    luminance = torch.cat([mean * math.sqrt(2), one * math.sqrt(C1)], 1)
    return structure, luminance, torch.cat([p * q, p, q, one], 1), torch.cat([one, q, p, p * q], 1)
