import pytest
import torch

from neumat.btf.synthesis.triangles import Grid
from neumat.seeds import torch_generator


def place(n=20_000, largest=1000):
    u = (torch.rand(n, 2, dtype=torch.float64, generator=torch_generator(1)) - 0.5) * largest
    cell = torch.floor(u)
    return cell.long(), u - cell


@pytest.mark.parametrize("tileable", [True, False])
def test_weights_are_barycentric(tileable):
    _, weights = Grid(32, 48, 1, tileable).patches(*place())
    assert weights.min() >= 0 and torch.allclose(weights.sum(1), torch.ones(len(weights)), atol=1e-6)
    assert torch.allclose(weights.mean(0), torch.full((3,), 1 / 3), atol=0.02)


@pytest.mark.parametrize("size", [(32, 48), (100, 75), (16, 16)])
def test_patches_keep_inside_an_exemplar_that_does_not_tile(size):
    positions, _ = Grid(*size, 1, False).patches(*place())
    texels = positions * torch.tensor(size[::-1])
    assert texels.min() >= 0.5
    assert (texels <= torch.tensor(size[::-1]) - 0.5).all()


@pytest.mark.parametrize("tileable", [True, False])
def test_patches_are_shifted_by_whole_texels(tileable):
    cell, fraction = place()
    positions, _ = Grid(30, 44, 1, tileable).patches(cell, fraction)
    texels = (positions - fraction[:, None]) * torch.tensor([44, 30])
    assert (texels - texels.round()).abs().max() < 1e-9


def test_a_triangle_has_the_same_patches_all_over():
    cell, fraction = place(1)
    u = fraction + torch.tensor([[0.0, 0.0], [1e-9, 0.0], [0.0, 1e-9]])
    positions, _ = Grid(32, 32, 1, True).patches(cell.expand(3, 2), u)
    shifts = positions - u[:, None]
    assert torch.allclose(shifts, shifts[:1].expand_as(shifts))


def test_neighbouring_triangles_agree_on_their_edge():
    t = torch.rand(300, dtype=torch.float64, generator=torch_generator(2))
    edge = torch.stack([t, torch.full_like(t, 0.25)], -1)  # horizontal edges of triangles
    sums = []
    for side in (-1e-9, 1e-9):
        positions, weights = Grid(32, 32, 1, True).patches(torch.zeros(300, 2).long(), edge + torch.tensor([0, side]))
        shift = (positions - edge[:, None]).remainder(1)
        sums.append((weights.double()[..., None] * torch.sin(2 * torch.pi * shift)).sum(1))
    assert torch.allclose(*sums, atol=1e-6)
