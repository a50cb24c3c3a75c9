"""Structural similarity of many pictures with many others.

Numerator and denominator of SSIM (Wang et al. 2004; M3ashy, equations 25 to 34 with a = b = c = 1) are inner products
between something that depends on the first picture only and something that depends on the second only. So a table is
two matrix products per window and one division, and each picture's statistics are taken once for all tables.
"""

import math

import torch

C1 = 0.01**2  # k1 = 0.01, k2 = 0.03, pictures scaled to [0, 1]
C2 = 0.03**2
_WINDOWS = 64  # whose statistics are taken at a time
_PAIRS = 1 << 17  # of pictures in a window, at a time: the working set fits a core's L2 cache


def ssim_tables(images, blocks, window=3, step=13):
    """Return the mean SSIM of the pictures of every block, [float64 (rows, columns)].

    images: uint8 tensor (n, H, W, 3). blocks: pairs of slices of the pictures, rows and columns.

    The mean is over the channels and over the uniform `window` x `window` windows inside the picture. With step 1
    it equals skimage's structural_similarity(win_size=window, channel_axis=-1, data_range=255); window 3 is the
    released M3ashy code's. Windows in which all pictures agree, such as the background, have SSIM 1 and are counted
    without being computed; of the others every `step`-th is taken, row by row and channel by channel.
    On the sphere pictures of 240 MERL fields, step 13 is off by 2e-4 on average and 1e-3 at most.
    """
    pixels = images.flatten(1).T.contiguous()  # (H W 3, n)
    windows, inside = _windows(images, window)
    chosen = windows[::step]
    totals = [torch.zeros(len(images[a]), len(images[b]), dtype=torch.float64) for a, b in blocks]
    for chunk in chosen.split(_WINDOWS):
        factors = _factors(pixels[chunk].float() / 255)
        for (a, b), total in zip(blocks, totals, strict=True):
            total += _sums(*factors, a, b)
    share = len(windows) / inside
    return [total * (share / max(len(chosen), 1)) + (1 - share) for total in totals]


def _sums(product, left, right, a, b):
    """Return the sums over the windows of the SSIM of pictures `a` with pictures `b`, from `_factors`."""
    factors = product[:, :, a].mT, product[:, :, b], left[:, :, a].mT, right[:, :, b]
    shape = factors[0].shape[1], factors[1].shape[2]
    at_once = max(1, _PAIRS // math.prod(shape))
    total = torch.zeros(at_once, *shape)
    for x, y, p, q in zip(*(factor.split(at_once) for factor in factors), strict=True):
        total[: len(x)].addcdiv_(torch.bmm(x, y), torch.bmm(p, q))
    return total.sum(0)


def _windows(images, window):
    """Return the flat pixel indices (windows, window^2) of the windows in which pictures differ, each channel apart,
    and the number of all windows inside the picture."""
    differs = (images.amin(0) != images.amax(0)).permute(2, 0, 1)  # (3, H, W)
    active = torch.nn.functional.max_pool2d(differs.float(), window, stride=1) > 0
    channel, y, x = active.nonzero(as_tuple=True)
    width = differs.shape[2]
    offset = torch.arange(window)
    offset = (offset[:, None] * width + offset).flatten() * 3
    return ((y * width + x) * 3 + channel)[:, None] + offset, active.numel()


def _factors(x):
    """Return the factors of SSIM of windows x (P, window^2, n): the numerator (2 mu mu' + C1)(2 cov + C2) is the
    product of the first with itself, the denominator (p + p')(q + q') is the product of the last two."""
    mean = x.mean(1, keepdim=True)
    centred = x - mean
    samples = x.shape[1] - 1
    p = mean.square() + C1 / 2
    q = centred.square().sum(1, keepdim=True) / samples + C2 / 2
    one = torch.ones_like(mean)
    structure = torch.cat([centred * math.sqrt(2 / samples), one * math.sqrt(C2)], 1)
    product = torch.cat([structure * (mean * math.sqrt(2)), structure * math.sqrt(C1)], 1)
    return product, torch.cat([p * q, p, q, one], 1), torch.cat([one, q, p, p * q], 1)
