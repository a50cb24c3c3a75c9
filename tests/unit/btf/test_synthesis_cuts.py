import pytest
import torch

from neumat.btf.synthesis.cuts import beyond_cut, comparable, fitting, minimum_cut, mismatches
from neumat.seeds import torch_generator


def test_a_minimum_cut_by_hand():
    errors = torch.tensor(
        [
            [9.0, 1.0, 9.0, 0.0],
            [9.0, 9.0, 1.0, 9.0],
            [9.0, 1.0, 9.0, 9.0],
            [2.0, 9.0, 9.0, 0.0],
        ]
    )
    # From the 0 at the upper right: 0, 1, 1, 2; the 0 at the lower right can't be reached as cheaply.
    assert minimum_cut(errors[None]).tolist() == [[3, 2, 1, 0]]


@pytest.mark.parametrize("width", [1, 2, 5])
def test_cuts_are_the_least_of_all_connected_paths(width):
    errors = torch.rand(20, 5, width, generator=torch_generator(1))
    paths = torch.cartesian_prod(*[torch.arange(width)] * 5).reshape(-1, 5)
    paths = paths[(paths.diff(dim=1).abs() <= 1).all(1)]
    sums = errors[:, torch.arange(5), paths].sum(2)
    found = minimum_cut(errors)
    assert (found.diff(dim=1).abs() <= 1).all()
    assert torch.allclose(errors.gather(2, found[..., None]).sum((1, 2)), sums.amin(1))


def test_beyond_a_cut_lies_what_is_farther_from_the_border():
    errors = torch.ones(1, 6, 7)
    errors[:, :, 1] = 0
    assert torch.equal(beyond_cut(errors, 3, 2, False)[0], (torch.arange(7) > 1).expand(6, 7))
    assert torch.equal(beyond_cut(errors.flip(2), 3, 2, True)[0], (torch.arange(7) < 5).expand(6, 7))
    assert torch.equal(beyond_cut(errors.transpose(1, 2), 3, 1, False)[0], (torch.arange(7) > 1)[:, None].expand(7, 6))


def test_mismatches_are_sums_of_squares_over_what_is_known():
    features = torch.randn(3, 8, 9, generator=torch_generator(2))
    targets = torch.randn(2, 3, 4, 5, generator=torch_generator(3))
    known = torch.rand(4, 5, generator=torch_generator(4)) > 0.4
    found = mismatches(features, targets, known)
    assert found.shape == (2, 5, 5)
    for i, j in ((0, 0), (4, 3), (2, 4)):
        expected = ((features[:, i : i + 4, j : j + 5] - targets).square().sum(1) * known).sum((1, 2))
        assert torch.allclose(found[:, i, j], expected, rtol=1e-4)


def test_what_fits_exactly_is_found():
    features = torch.randn(2, 20, 20, generator=torch_generator(5))
    targets = torch.stack([features[:, 3:8, 7:12], features[:, 11:16, 2:7]])
    errors = mismatches(features, targets, torch.ones(5, 5))
    assert fitting(errors, torch_generator(6)).tolist() == [[3, 7], [11, 2]]
    room = torch.ones(16, 16, dtype=torch.bool)
    room[3, 7] = False
    assert fitting(errors, torch_generator(6), room).tolist()[0] != [3, 7]


def test_comparable_features_keep_distances_but_for_one_scale():
    plane = torch.randn(12, 10, 3, generator=torch_generator(7))
    found = comparable(plane).flatten(1).T
    ratio = torch.cdist(found, found) / torch.cdist(plane.flatten(0, 1), plane.flatten(0, 1)).clamp_min(1e-9)
    off = ~torch.eye(120, dtype=torch.bool)
    assert torch.allclose(ratio[off], ratio[off].mean(), rtol=1e-3)
    assert torch.allclose(found.square().sum(1).mean(), torch.tensor(1.0), rtol=1e-4)
