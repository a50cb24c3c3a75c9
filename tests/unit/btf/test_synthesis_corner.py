import pytest
import torch

from neumat.btf.synthesis.corner import Corner
from neumat.btf.synthesis.corner_tiles import cut_tiles
from neumat.btf.synthesis.lattice import autocovariance
from neumat.seeds import torch_generator


def smooth(height, width, channels=8):
    plane = torch.randn(height, width, channels, generator=torch_generator(1))
    for axis in (0, 1):
        plane = sum(plane.roll(shift, axis) for shift in range(7))
    return plane / plane.std()


def shown(plane, tiles):
    """The texels (tiles, R, C), as H W indices, of cut tiles."""
    height, width, _ = plane.shape
    layers, first = tiles[0].long().flatten(1), torch.stack(tiles[1:], -1).long()
    first = torch.gather(first, 1, layers[..., None].expand(-1, -1, 2)).unflatten(1, tiles[0].shape[1:])
    y, x = (torch.arange(n) for n in tiles[0].shape[1:])
    return (first[..., 0] + y[:, None]).remainder(height) * width + (first[..., 1] + x).remainder(width)


@pytest.mark.parametrize("tileable", [True, False])
@pytest.mark.parametrize("colours, columns, rows", [(2, 20, 15), (3, 13, 22), (4, 18, 18), (2, 5, 5), (2, 1, 1)])
def test_tiles_that_share_two_corners_share_the_edge_exactly(tileable, colours, columns, rows):
    plane = smooth(60, 48, 2)
    correlation = autocovariance(plane, tileable)
    tiles = cut_tiles(plane, correlation, colours, columns, rows, tileable, torch_generator(2))
    texels = shown(plane, tiles).unflatten(0, (colours,) * 4)
    upper, lower = texels[..., 0, :], texels[..., -1, :]
    across = upper[:, :, 0, 0]
    assert (upper == across[:, :, None, None]).all() and (lower == across).all()
    left, right = texels[..., 0], texels[..., -1]
    down = left[:, 0, :, 0]
    assert (left == down[:, None, :, None]).all() and (right == down[None, :, None]).all()


def test_patches_keep_inside_an_exemplar_that_does_not_tile():
    plane = smooth(60, 60, 2)
    texels = shown(plane, cut_tiles(plane, autocovariance(plane, False), 3, 21, 21, False, torch_generator(3)))
    apart = texels.diff(dim=2)
    inner = (apart == 1) & (texels[:, :, 1:] % 60 == 0)  # from the last column of one row to the first of the next
    assert not inner.any()


def test_cuts_are_no_worse_than_the_texture_itself():
    plane = smooth(96, 96)
    texels = shown(plane, cut_tiles(plane, autocovariance(plane, True), 4, 34, 34, True, torch_generator(4)))
    step = plane.flatten(0, 1)[texels].diff(dim=2).norm(dim=-1)
    joined = (texels.diff(dim=2) != 1) & (texels[..., 1:] % 96 != 0)
    assert 0.01 < joined.float().mean() < 0.2
    assert step[joined].mean() < 4 * step[~joined].mean()


def test_a_sample_is_a_texel_of_the_exemplar():
    plane = smooth(64, 64, 3)
    texel = torch.randint(-5000, 5000, (3000, 2), generator=torch_generator(5))
    features = Corner(plane, 1, True).at((texel.double() + 0.5) / 64)
    nearest = torch.cdist(features, plane.flatten(0, 1)).amin(1)
    assert nearest.max() < 2e-3


def test_sides_of_tiles_are_lags_of_the_lattice():
    x = torch.arange(96) * (2 * torch.pi / 12)
    plane = (torch.sin(x)[:, None] + torch.sin(x * 12 / 16))[..., None].expand(-1, -1, 8)
    plane = plane + 0.3 * torch.randn(96, 96, 8, generator=torch_generator(6))
    width, height = Corner(plane, 1).steps
    assert width % 16 == 0 and height % 12 == 0


def test_the_more_channels_the_more_colours_fit():
    assert Corner(smooth(64, 64, 8), 1).colours > Corner(smooth(64, 64, 1), 1).colours
