"""The most different of many fields."""

import torch

from neumat.conditions.diversity import most_different
from neumat.fields.layout import SIZE
from neumat.seeds import torch_generator


def test_each_is_the_farthest_from_those_before_it(lambert):
    rows = torch.stack([lambert(0.1, 0.2, 0.9, 0.5), lambert(0.5, 0.05, 0.2, 0.9)])
    assert most_different(rows, 3).tolist() == [[0, 2, 3], [0, 1, 3]]


def test_all_are_chosen_once_where_all_are_wanted():
    weights = 0.3 * torch.randn(2, 7, SIZE, generator=torch_generator(0, "variety"))
    weights[1] = weights[1, 0]
    assert most_different(weights, 7).sort(1).values.tolist() == [list(range(7))] * 2


def test_what_is_there_twice_is_chosen_last(lambert):
    assert most_different(lambert(0.3, 0.3, 0.31, 0.7)[None], 3).tolist() == [[0, 3, 2]]
