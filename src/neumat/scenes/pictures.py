"""Pictures of composed scenes: rendered in passes, so that a long one shows how far it is."""

import math

import numpy as np
import torch
from scipy.ndimage import rank_filter

from neumat.render.mitsuba_scene import mitsuba
from neumat.render.scene import to_srgb8

PASSES = (64, 16, 4)  # samples a pixel of a pass: squares, which the sampler spreads evenly
PATHS = 12_000_000  # of a pass at most: some 2 GB
OUTSHINES = 1.5  # times as bright as all but one of the eight pixels around: what noise and edges hardly reach


def render(composition, samples, seed=0, progress=iter):
    """Return the linear picture (height, width, 3), float32, with at least `samples` samples a pixel."""
    mi = mitsuba()
    pixels = composition.width * composition.height
    spp = next((n for n in PASSES if n <= samples and n * pixels <= PATHS), PASSES[-1])
    passes = math.ceil(samples / spp)
    total = 0
    for k in progress(range(passes)):
        total = total + np.array(mi.render(composition.scene, spp=spp, seed=seed * 65536 + k))
    return (total / passes).astype(np.float32)


def without_fireflies(linear):
    """Return a linear picture (height, width, 3) without lone bright pixels, which the few paths leave that meet the
    sun by way of a mirror. Each gets the median of those around it. For people to look at, not for measuring."""
    around = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], bool)
    brightness = linear.mean(2)
    firefly = brightness > OUTSHINES * rank_filter(brightness, -2, footprint=around, mode="mirror")
    median = rank_filter(linear, 3, footprint=around[..., None], mode="mirror")
    return np.where(firefly[..., None], median, linear)


def shown(linear, exposure):
    """Return a linear picture, an array or a tensor, as 8-bit sRGB, uint8."""
    return to_srgb8(torch.as_tensor(linear), exposure).numpy()
