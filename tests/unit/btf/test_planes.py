import math

import pytest
import torch

from neumat.btf.planes import blend, fetch, prefilter
from neumat.seeds import torch_generator


def random_plane(height, width, channels=3):
    return torch.rand(height, width, channels, generator=torch_generator(1))


def test_centres_of_texels_give_the_texels():
    plane = random_plane(5, 7)
    i, j = torch.meshgrid(torch.arange(5), torch.arange(7), indexing="ij")
    u = torch.stack([(j + 0.5) / 7, (i + 0.5) / 5], -1).reshape(-1, 2).double()
    for wrap in (False, True):
        assert torch.allclose(fetch(plane, u, wrap).reshape(5, 7, 3), plane, atol=1e-6)


def test_a_ramp_is_linear_between_the_outer_centres_and_flat_beyond():
    plane = torch.arange(8.0)[None, :, None].expand(3, 8, 1)
    x = torch.linspace(-1, 2, 200, dtype=torch.float64)
    u = torch.stack([x, torch.full_like(x, 0.3)], -1)
    assert torch.allclose(fetch(plane, u, False)[:, 0], (x * 8 - 0.5).clamp(0, 7).float(), atol=1e-5)


def test_wrapped_positions_repeat():
    plane = random_plane(4, 6)
    u = torch.rand(100, 2, dtype=torch.float64, generator=torch_generator(2))
    assert torch.allclose(fetch(plane, u + torch.tensor([3, -5]), True), fetch(plane, u, True), atol=1e-5)


def test_sums_of_fetches_are_weighted():
    plane = random_plane(4, 6)
    u = torch.rand(50, 2, 2, dtype=torch.float64, generator=torch_generator(3))
    weights = torch.rand(50, 2, generator=torch_generator(4))
    expected = sum(weights[:, k : k + 1] * fetch(plane, u[:, k], True) for k in range(2))
    assert torch.allclose(blend(plane, u, weights, True), expected, atol=1e-6)


def test_positions_that_are_nan_give_nan():
    assert fetch(random_plane(3, 3), torch.tensor([[math.nan, 0.5]], dtype=torch.float64), False).isnan().all()


@pytest.mark.parametrize("size", [(8, 8), (1, 1), (5, 12), (100, 64), (7, 1)])
def test_levels_keep_the_mean_down_to_one_texel(size):
    plane = random_plane(*size)
    levels = prefilter(plane)
    assert torch.equal(levels[0], plane) and levels[-1].shape == (1, 1, 3)
    assert len(levels) == 1 + math.ceil(math.log2(max(size)))
    for level in levels:
        assert torch.allclose(level.mean((0, 1)), plane.mean((0, 1)), atol=1e-5)


def test_a_level_of_even_size_is_the_mean_of_blocks():
    plane = random_plane(4, 6)
    expected = (plane[::2, ::2] + plane[1::2, ::2] + plane[::2, 1::2] + plane[1::2, 1::2]) / 4
    assert torch.allclose(prefilter(plane)[1], expected, atol=1e-6)


def test_a_texel_of_an_odd_level_is_the_mean_over_its_footprint():
    plane = torch.tensor([1.0, 2.0, 6.0]).reshape(1, 3, 1)
    assert torch.allclose(prefilter(plane)[1].flatten(), torch.tensor([(1 + 0.5 * 2) / 1.5, (0.5 * 2 + 6) / 1.5]))


def test_a_constant_plane_has_constant_levels():
    plane = torch.full((13, 9, 2), 0.1)
    assert all((level == plane[0, 0]).all() for level in prefilter(plane))
