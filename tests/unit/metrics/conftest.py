import math

import pytest
import torch

from neumat.fields.layout import SIZE, unpack
from neumat.metrics.materials import MaterialSet


@pytest.fixture
def make_set():
    def make(n, seed=0, size=24, entries=64):
        """n random materials: pictures with a common flat border, values mostly small with a few high ones."""
        generator = torch.Generator().manual_seed(seed)
        brdf = torch.rand(n, entries, 3, generator=generator) ** 4 * 10
        images = torch.full((n, size, size, 3), 40, dtype=torch.uint8)
        inner = torch.randint(0, 256, (n, size // 4, size // 4, 3), generator=generator)
        inner = inner.repeat_interleave(2, 1).repeat_interleave(2, 2).to(torch.uint8)
        images[:, 6 : 6 + inner.shape[1], 6 : 6 + inner.shape[2]] = inner
        return MaterialSet(torch.arange(entries) * 37, brdf, images)

    return make


@pytest.fixture
def field():
    def make(albedo=0.0, peak=0.0, fall=100.0):
        """Weights (675,) with f = albedo / pi + a highlight, log(1 + f) falling linearly by `fall` times sin theta_h.

        albedo: a number or one per channel. peak: f at theta_h = 0, 1/sr, the same in all channels.
        """
        weights = torch.zeros(SIZE)
        (w1, b1), (w2, _), (w3, b3) = unpack(weights)
        b3[:] = torch.log1p(torch.as_tensor(albedo) / math.pi)
        w1[0, 0], b1[0], w2[0, 0], w3[0] = -fall, math.log1p(peak), 1.0, 1.0
        return weights

    return make
