import pytest
import torch

from neumat.btf.synthesis.quilting import Quilting, quilt
from neumat.seeds import torch_generator


@pytest.mark.parametrize("size", [(40, 40), (16, 24), (3, 5)])
@pytest.mark.parametrize("tileable", [True, False])
def test_a_quilt_shows_texels_of_the_exemplar_everywhere(size, tileable):
    plane = torch.randn(*size, 2, generator=torch_generator(1))
    found = quilt(plane, (3 * size[0], 3 * size[1]), torch_generator(2), tileable)
    assert found.shape == (3 * size[0], 3 * size[1])
    assert found.min() >= 0 and found.max() < size[0] * size[1]
    assert len(found.unique()) > 0.6 * size[0] * size[1]


def test_a_quilt_of_stripes_is_striped():
    """Stripes that repeat after 4 texels: blocks that fit continue them, over the quilt's border too."""
    stripes = (torch.arange(48) // 2 % 2).float().expand(48, 48)[..., None]
    found = stripes.flatten()[quilt(stripes, (96, 96), torch_generator(3))]
    assert torch.equal(found, found[:1].expand(96, 96))
    assert torch.equal(found[0].roll(4), found[0])


def test_steps_across_cuts_are_like_those_inside():
    plane = torch.randn(64, 64, 1, generator=torch_generator(4))
    for axis in (0, 1):
        plane = sum(plane.roll(shift, axis) for shift in range(9))
    texels = quilt(plane, (192, 192), torch_generator(5), True)
    step = plane.flatten()[texels].diff(dim=1).abs()
    joined = (texels.diff(dim=1) != 1) & (texels[:, 1:] % 64 != 0)
    assert 0.01 < joined.float().mean() < 0.3
    assert step[joined].mean() < 2.5 * step[~joined].mean()


def test_it_repeats_beyond_its_extent_and_tells_its_bytes():
    method = Quilting(torch.rand(20, 20, 3, generator=torch_generator(6)), 1, True, extent=3)
    u = torch.rand(50, 2, dtype=torch.float64, generator=torch_generator(7)) * 3
    assert torch.allclose(method.at(u + torch.tensor([9, -6])), method.at(u), atol=1e-4)
    assert method.bytes > 9 * 20 * 20 * 3 * 4 and not method.dynamic
