"""How near two pictures are, pair by pair: PSNR and SSIM."""

import numpy as np
from skimage.metrics import peak_signal_noise_ratio, structural_similarity


def compare_pictures(expected, found):
    """Return (psnr dB, ssim), each (n,), of 8-bit pictures (n, height, width, 3).

    SSIM with the 7 x 7 uniform window of scikit-image. Equal pictures have an infinite PSNR; it is capped at that of
    one grey level in one channel of one pixel.
    """
    cap = 10 * np.log10(255**2 * expected[0].numel())
    pairs = list(zip(expected.numpy(), found.numpy(), strict=True))
    with np.errstate(divide="ignore"):
        psnr = [min(cap, peak_signal_noise_ratio(a, b, data_range=255)) for a, b in pairs]
    ssim = [structural_similarity(a, b, channel_axis=2, data_range=255) for a, b in pairs]
    return np.array(psnr), np.array(ssim)
