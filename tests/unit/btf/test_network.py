"""The hand-written backward pass against PyTorch's own."""

import pytest
import torch

from neumat.btf.representations.angular import gather, nodes, scatter
from neumat.btf.representations.network import LOSSES, forward, gradients
from neumat.seeds import torch_generator

ROWS, PAIRS, CHANNELS, WIDTH = 6, 5, 3, 7


@pytest.fixture
def problem():
    generator = torch_generator(0, "network")

    def normal(*size):
        return torch.randn(size, generator=generator, dtype=torch.float64)

    first, layers = normal(WIDTH, CHANNELS), [normal(WIDTH, WIDTH), normal(WIDTH, WIDTH), normal(3, WIDTH)]
    return first, layers, normal(CHANNELS, ROWS, PAIRS), normal(WIDTH, PAIRS), normal(3, ROWS, PAIRS)


def loss_of(error, name):
    if name == "l1":
        return error.abs().sum()
    if name == "l2":
        return error.square().sum() / 2
    return torch.nn.functional.huber_loss(error, torch.zeros_like(error), reduction="sum", delta=0.05)


@pytest.mark.parametrize("name", sorted(LOSSES))
def test_gradients_equal_autograd(problem, name):
    first, layers, plane, angular, target = problem
    leaves = [each.clone().requires_grad_() for each in (first, plane, angular, *layers)]
    x = torch.einsum("wc,ckp->wkp", leaves[0], leaves[1]) + leaves[2][:, None]
    for layer in leaves[3:]:
        x = torch.einsum("wv,vkp->wkp", layer, x.relu())
    expected = torch.autograd.grad(loss_of(x - target, name), leaves)
    (of_first, *of_layers), of_plane, of_angular = gradients(first, layers, plane, angular, target, name)
    for found, truth in zip((of_first, of_plane, of_angular, *of_layers), expected, strict=True):
        assert torch.allclose(found, truth, rtol=1e-10, atol=1e-12)


def test_blocks_change_nothing(problem):
    whole, rows = (gradients(*problem, "l1", block=block) for block in (1 << 20, 1))
    for one, other in zip([*whole[0], *whole[1:]], [*rows[0], *rows[1:]], strict=True):
        assert torch.allclose(one, other, rtol=1e-12, atol=1e-12)


def test_forward_is_the_pass_that_is_trained(problem):
    """Where the target is the output, the gradient of the squared loss vanishes."""
    first, layers, plane, angular, _ = problem
    target = forward(first, layers, plane.flatten(1), angular.repeat(1, ROWS)).view(3, ROWS, PAIRS)
    for found in gradients(first, layers, plane, angular, target, "l2")[1:]:
        assert found.abs().max() < 1e-12


def test_fetch_is_exact_for_linear_functions_and_scatter_is_its_transpose():
    generator = torch_generator(0, "nodes")
    side, position = 5, torch.rand(40, 2, generator=generator, dtype=torch.float64)
    grid = torch.arange(side, dtype=torch.float64) / (side - 1)
    row, column = torch.meshgrid(grid, grid, indexing="ij")
    plane = torch.stack([2 * column - row + 1, column, torch.ones_like(row)], -1).view(-1, 3)
    index, weight = nodes(position, side)
    x, y = position.T
    found = gather(plane, index, weight)
    assert torch.allclose(found, torch.stack([2 * x - y + 1, x, torch.ones_like(x)]))
    other = torch.randn(3, 40, generator=generator, dtype=torch.float64)
    assert torch.allclose((scatter(other, index, weight, side) * plane).sum(), (other * found).sum())
    outside = torch.tensor([[-3.0, 0.5], [1.0, 7.0]])
    assert torch.equal(nodes(outside, side)[1], nodes(outside.clamp(0, 1), side)[1])
