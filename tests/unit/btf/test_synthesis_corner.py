import pytest
import torch

from neumat.btf.synthesis.corner import Corner
from neumat.btf.synthesis.corner_tiles import ANCHORS, cut_tiles
from neumat.btf.synthesis.cuts import comparable
from neumat.btf.synthesis.frame import Frame
from neumat.btf.synthesis.lattice import PARTS, autocovariance
from neumat.seeds import torch_generator


def smooth(height, width, channels=8):
    plane = torch.randn(height, width, channels, generator=torch_generator(1))
    for axis in (0, 1):
        plane = sum(plane.roll(shift, axis) for shift in range(7))
    return plane / plane.std()


def shown(plane, colours, columns, rows, tileable):
    """The texels (tiles, R, C, 2), x and y, that cut tiles with sides along the axes show."""
    frame = Frame(plane, [(columns, 0.0), (0.0, rows)], (columns, rows), tileable)
    layers, first = cut_tiles(frame, colours, columns, rows, torch_generator(2))
    corner = torch.tensor([(rows * j, columns * i) for i, j in ANCHORS])
    source = torch.gather(first - corner, 1, layers.flatten(1).long()[..., None].expand(-1, -1, 2))
    y, x = torch.meshgrid(torch.arange(rows + 1), torch.arange(columns + 1), indexing="ij")
    return frame.texels(source.unflatten(1, layers.shape[1:]) + torch.stack([y, x], -1))


@pytest.mark.parametrize("tileable", [True, False])
@pytest.mark.parametrize("colours, columns, rows", [(2, 20, 15), (3, 13, 22), (4, 18, 18), (2, 6, 6), (2, 1, 1)])
def test_tiles_that_share_two_corners_share_the_edge_exactly(tileable, colours, columns, rows):
    texels = shown(smooth(60, 48, 2), colours, columns, rows, tileable).unflatten(0, (colours,) * 4)
    upper, lower = texels[..., 0, :, :], texels[..., -1, :, :]
    across = upper[:, :, 0, 0]
    assert (upper == across[:, :, None, None]).all() and (lower == across).all()
    left, right = texels[..., 0, :], texels[..., -1, :]
    down = left[:, 0, :, 0]
    assert (left == down[:, None, :, None]).all() and (right == down[None, :, None]).all()


def test_patches_keep_inside_an_exemplar_that_does_not_tile():
    texels = shown(smooth(60, 48, 2), 3, 19, 22, False)
    assert texels.min() >= 0 and (texels <= torch.tensor([47, 59])).all()
    plane = torch.zeros(96, 96, 8) + lattice(((14.3, 2), (5, 13)), 96)
    # Beyond the border the fetch would show the outer texels again and again.
    features = Corner(plane, 1).at(torch.rand(20_000, 2, dtype=torch.float64, generator=torch_generator(3)) * 100)
    assert abs(features.var(0).mean() - plane.var((0, 1)).mean()) < 0.15


def test_cuts_are_no_worse_than_the_texture_itself():
    plane = smooth(96, 96)
    texels = shown(plane, 4, 34, 34, True)
    step = plane[texels[..., 1] % 96, texels[..., 0] % 96].diff(dim=2).norm(dim=-1)
    joined = (texels.diff(dim=2) != torch.tensor([1, 0])).any(-1)
    assert 0.01 < joined.float().mean() < 0.2
    assert step[joined].mean() < 4 * step[~joined].mean()


def lattice(sides, size):
    """Waves on the lattice of two lags (x, y)."""
    (a, b), (c, d) = sides
    y, x = torch.meshgrid(torch.arange(size), torch.arange(size), indexing="ij")
    f, g = (d * x - c * y) / (a * d - b * c), (a * y - b * x) / (a * d - b * c)
    return (torch.cos(2 * torch.pi * f) + torch.cos(2 * torch.pi * g))[..., None]


def test_a_turned_lattice_goes_on():
    sides = ((14.3, 2), (-1.8, 12.9))
    plane = lattice(sides, 96).expand(-1, -1, 8) + 0.2 * torch.randn(96, 96, 8, generator=torch_generator(4))
    texel = torch.arange(288, dtype=torch.float64)
    y, x = torch.meshgrid(texel, texel, indexing="ij")
    picture = Corner(plane, 1).at((torch.stack([x, y], -1).reshape(-1, 2) + 0.5) / 96).reshape(288, 288, 8)
    truth = autocovariance(lattice(sides, 288), False)[188:387, 188:387]
    found = autocovariance(picture, False)[188:387, 188:387]
    assert torch.corrcoef(torch.stack([truth.flatten(), found.flatten()]))[0, 1] > 0.9


def test_a_sample_is_a_texel_of_the_exemplar():
    plane = smooth(64, 64, 3)
    texel = torch.randint(-5000, 5000, (3000, 2), generator=torch_generator(5))
    features = Corner(plane, 1, True).at((texel.double() + 0.5) / 64)
    nearest = torch.cdist(features, plane.flatten(0, 1)).amin(1)
    assert nearest.max() < 2e-3


def test_sides_of_tiles_are_lags_of_the_lattice():
    plane = lattice(((16, 0), (0, 12)), 96) + 0.3 * torch.randn(96, 96, 8, generator=torch_generator(6))
    cells = Corner(plane, 1).cells
    for x, y in ((cells.a, cells.b), (cells.c, cells.d)):
        assert abs(x / PARTS / 16 - round(x / PARTS / 16)) < 0.02 and abs(y / PARTS / 12 - round(y / PARTS / 12)) < 0.02


@pytest.mark.parametrize("tileable", [True, False])
def test_a_frame_along_the_axes_is_the_exemplar(tileable):
    frame = Frame(smooth(20, 30, 3), [(8.0, 0.0), (0.0, 6.0)], (8, 6), tileable)
    features = comparable(smooth(20, 30, 3))
    assert torch.allclose(frame.features[:, :20, :30], features, atol=1e-5)
    if tileable:
        assert torch.allclose(frame.features[:, 20:, :30], features[:, : frame.features.shape[1] - 20], atol=1e-5)
    else:
        assert frame.features.shape[1:] == (20, 30) and frame.inside.all()


def test_a_turned_frame_knows_where_the_exemplar_ends():
    frame = Frame(smooth(40, 40, 2), [(9.0, 3.0), (-3.0, 9.0)], (9, 9), False)
    samples = frame.inside.nonzero()
    texels = frame.texels(samples)
    assert texels.min() >= 0 and texels.max() <= 39
    assert 0.9 < len(samples) * 10 / 9 / 40**2 < 1.1  # a sample stands for 10 / 9 texels
    room = frame.room(5, 7).nonzero()
    assert len(room) and all(frame.inside[i : i + 5, j : j + 7].all() for i, j in room.tolist())


def test_the_more_channels_the_more_colours_fit():
    assert Corner(smooth(64, 64, 8), 1).colours > Corner(smooth(64, 64, 1), 1).colours
