"""The most different of many fields."""

import torch

from neumat.conditions.diversity import most_different
from neumat.fields.layout import SIZE
from neumat.seeds import torch_generator


def test_the_first_is_the_most_typical_and_each_the_farthest_from_those_before_it(lambert):
    rows = torch.stack([lambert(0.1, 0.2, 0.3, 0.8, 0.35), lambert(0.48, 0.05, 0.55, 0.9, 0.6)])
    assert most_different(rows, 3).tolist() == [[2, 1, 4], [2, 0, 4]]


def test_outliers_are_left_out_while_there_are_others(lambert):
    rows = lambert(0.3, 0.31, 0.9, 0.32, 0.29, 0.02, 0.33, 0.28)[None]
    assert not {2, 5} & set(most_different(rows, 6)[0].tolist())


def test_all_are_chosen_once_where_all_are_wanted():
    weights = 0.3 * torch.randn(2, 7, SIZE, generator=torch_generator(0, "variety"))
    weights[1] = weights[1, 0]
    assert most_different(weights, 7).sort(1).values.tolist() == [list(range(7))] * 2


def test_what_is_there_twice_is_chosen_last(lambert):
    assert most_different(lambert(0.3, 0.3, 0.31, 0.32)[None], 4)[0].tolist()[-1] in (0, 1)
