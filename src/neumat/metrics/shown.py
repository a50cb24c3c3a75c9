"""Errors of linear pictures as they are shown: PSNR, DSSIM and FLIP of 8-bit sRGB."""

import numpy as np

from neumat.metrics.flip import flip
from neumat.metrics.pictures import compare_pictures
from neumat.render.scene import to_srgb8


def shown_errors(expected, found, exposure):
    """Return {"psnr": dB, "dssim": , "flip": }, each an array (n,), of linear pictures (n, H, W, 3).

    Both are multiplied by `exposure`, clipped to 0..1 and shown as sRGB. dssim = (1 - SSIM) / 2; flip is the mean of
    the FLIP map. H and W are at least 7, the window of SSIM.
    """
    expected, found = (to_srgb8(pictures.float(), exposure) for pictures in (expected, found))
    psnr, ssim = compare_pictures(expected, found)
    maps = [flip(a.numpy(), b.numpy()).mean() for a, b in zip(expected, found, strict=True)]
    return {"psnr": psnr, "dssim": (1 - ssim) / 2, "flip": np.array(maps, dtype=float)}
