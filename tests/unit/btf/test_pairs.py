"""Which pairs of directions are captured."""

import math

import torch

from neumat.btf.pairs import STEEPEST, given_pairs, grid_pairs, held_out_pairs


def test_a_grid_has_every_view_under_every_light():
    light, view = grid_pairs([0, 45], [1, 4])
    pairs = {tuple(pair) for pair in torch.cat([light, view], 1).round(decimals=5).tolist()}
    assert len(light) == len(pairs) == 25
    assert torch.equal(light[:5], light[5:10]) and (view[:5] == view[0]).all()


def test_held_out_pairs_of_the_report_are_others_than_those_of_the_validation():
    validation, report = (torch.cat(held_out_pairs(16, 0, name), 1) for name in ("validation", "report"))
    assert torch.cdist(validation, report).min() > 1e-3


def test_every_ring_of_views_has_its_share_of_held_out_pairs():
    light, view = held_out_pairs(30, 1, "report")
    rings = (view[:, 2].acos() / STEEPEST * 3).long()
    assert rings.bincount().tolist() == [10, 10, 10]
    assert light[:, 2].acos().max() <= STEEPEST + 1e-6


def test_given_pairs_are_in_degrees_and_name_the_light_first():
    light, view = given_pairs([[90, 90, 0, 0], [60, 0, 60, 180]])
    assert torch.allclose(light[0], torch.tensor([0.0, 1, 0]), atol=1e-6)
    assert torch.allclose(view[0], torch.tensor([0.0, 0, 1]), atol=1e-6)
    assert torch.allclose(light[1], torch.tensor([math.sqrt(0.75), 0, 0.5]), atol=1e-6)
    assert torch.allclose(view[1], torch.tensor([-math.sqrt(0.75), 0, 0.5]), atol=1e-6)
