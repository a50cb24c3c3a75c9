"""Fields in other colours: the body takes the wanted one, the highlight stays, as the closed form says."""

import pytest
import torch

from neumat.brdf.coordinates import grid_angles
from neumat.brdf.statistics import valid_entries
from neumat.conditions.ranges import colour_row, colours_within, linear_rgb, misfit, seen
from neumat.conditions.recolouring import recoloured
from neumat.fields.field import evaluate
from neumat.fields.validity import physical
from neumat.metrics.appearance import WHITE, appearance

COLOURS = torch.tensor([[0.5, 0.1, 0.02], [0.02, 0.1, 0.5], [0.6, 0.6, 0.6]])


def test_an_even_field_takes_any_colour(lambert):
    for colour in COLOURS:
        weights = lambert((0.3, 0.2, 0.1), (0.1, 0.1, 0.1))
        found = appearance(recoloured(weights, appearance(weights), colour.expand(2, -1)))
        diffuse = torch.tensor(found[["diffuse_r", "diffuse_g", "diffuse_b"]].to_numpy(), dtype=torch.float32)
        assert torch.allclose(diffuse, colour * WHITE, rtol=0.01)


@pytest.mark.parametrize("name", ["matte", "rough", "satin"])
def test_a_highlight_stays_and_the_body_takes_the_colour(ladder, name):
    weights = ladder[name][None]
    before = appearance(weights)
    assert not before["metallic"][0]
    for colour in COLOURS[:2]:
        made = recoloured(weights, before, colour[None])
        after = appearance(made)
        assert physical(made).all()
        assert abs(after["diffuse_r"][0] / (colour[0] * WHITE) - 1) < 0.1
        assert abs(after["diffuse_b"][0] / (colour[2] * WHITE) - 1) < 0.1
        assert abs(after["peak_30"][0] - before["peak_30"][0]) < 0.1 * before["peak_30"][0] + 0.05
        entries = valid_entries()[::5003]
        f, g = (evaluate(w, *grid_angles(entries)) for w in (made, weights))
        assert ((f.log1p() - g.log1p()).abs().mean()) < 0.06


def test_channels_in_the_other_order_are_exact(ladder):
    """The same colour with red and blue exchanged."""
    weights = ladder["satin"][None]
    seen_ = appearance(weights)
    own = torch.tensor(seen_[["diffuse_r", "diffuse_g", "diffuse_b"]].to_numpy()) / WHITE
    made = recoloured(weights, seen_, own.flip(1).float())
    entries = valid_entries()[::5003]
    f, g = (evaluate(w, *grid_angles(entries)) for w in (made, weights))
    assert (f.log1p() - g.flip(2).log1p()).abs().mean() < 0.01


def test_a_request_for_a_number_is_met_within_its_tolerance(ladder):
    weights = torch.stack([ladder[name] for name in ("matte", "rough", "satin")])
    looks = appearance(weights)
    for number in ((0.72, 0.45, 0.2), (0.2, 0.3, 0.7), (0.9, 0.85, 0.8)):
        wanted = colour_row(number).expand(len(weights), -1)
        colours = linear_rgb(colours_within(seen(looks), wanted))
        off = misfit(seen(appearance(recoloured(weights, looks, colours))), wanted)
        assert (off < 0.1).all(), off


def test_a_field_does_not_depend_on_the_others(ladder, monkeypatch):
    weights = torch.stack([ladder[name] for name in ("matte", "satin", "steel", "plastic", "rough")])
    looks, colours = appearance(weights), COLOURS[[0, 1, 2, 0, 1]]
    whole = recoloured(weights, looks, colours)
    monkeypatch.setattr("neumat.conditions.recolouring.BLOCK", 2)
    assert torch.allclose(recoloured(weights, looks, colours), whole, atol=1e-5)
