"""Levels of detail that are trained beside a plane."""

import pytest
import torch

from neumat.btf.planes import in_levels, level_sizes, means, prefilter
from neumat.btf.representations.encoding import Encoding
from neumat.btf.representations.levels import Levels
from neumat.seeds import torch_generator

SIZE = (5, 8)
IDENTITY = torch.eye(3), [torch.eye(3)], torch.zeros(3, 1)  # a network that answers with the features


@pytest.fixture
def plane():
    return torch.rand(*SIZE, 3, generator=torch_generator(0, "plane")) * 0.9 + 0.05


@pytest.mark.parametrize("size", [(1, 1), (5, 8), (16, 16), (1, 9)])
def test_texels_of_levels_go_together_and_apart(size):
    plane = torch.rand(*size, 2, generator=torch_generator(1, "plane"))
    levels = prefilter(plane)
    assert [level.shape[:2] for level in levels] == level_sizes(*size)
    parts = in_levels(means(plane), size)
    assert len(parts) == len(levels) - 1
    assert all(torch.equal(*pair) for pair in zip(parts, levels[1:], strict=True))


def test_levels_start_from_means_of_features_which_a_linear_network_need_not_change(plane):
    levels = Levels(SIZE, Encoding(1.0, 0.0))
    gradients, of_angular = levels.step(plane.flatten(0, 1).T, *IDENTITY, "l2", 0.0)
    assert all(torch.equal(*pair) for pair in zip(levels.planes(), prefilter(plane)[1:], strict=True))
    assert max(each.abs().max() for each in [*gradients, of_angular]) < 1e-5


def test_levels_come_to_decode_to_means_of_values(plane):
    encoding = Encoding(1.0, 24.0)
    levels = Levels(SIZE, encoding)
    for k in range(300):
        levels.step(plane.flatten(0, 1).T, *IDENTITY, "l1", 0.02 * (1 - k / 300))
    for level, values in zip(levels.planes(), prefilter(encoding.decode(plane))[1:], strict=True):
        assert torch.allclose(encoding.decode(level), values, rtol=5e-3)


@pytest.mark.parametrize("sweeps", [1, 2, 3, 10, 11])
def test_levels_are_trained_in_the_second_half_and_in_the_last_sweep(sweeps):
    due = [Levels(SIZE, Encoding(1.0, 0.0)).due(sweep, sweeps) for sweep in range(sweeps)]
    assert due[-1] and not any(due[: (sweeps - 1) // 2])
