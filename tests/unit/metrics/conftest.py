import pytest
import torch

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
