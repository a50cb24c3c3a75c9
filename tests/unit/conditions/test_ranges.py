"""Ranges of appearance: what lies within, how far the rest is, and where colours are moved to."""

import numpy as np
import pandas as pd
import torch
from hypothesis import given
from hypothesis import strategies as st

from neumat.conditions.ranges import WORDS, colour_row, colours_within, linear_rgb, misfit, row, word_row
from neumat.metrics.words import COLOURS, colour_name

OPEN = row()


def at(lightness, chroma, hue, gloss=0, metal=0):
    return torch.tensor([lightness, chroma, hue, gloss, metal], dtype=torch.float32)


def test_the_inside_of_a_colour_word_has_that_name():
    assert set(WORDS) == set(COLOURS)
    for word in COLOURS:
        (light, chroma, hue, metal), n = WORDS[word], 6
        start, width = (0, 359) if hue is None else (hue[0], (hue[1] - hue[0]) % 360)
        grid = np.meshgrid(np.linspace(*light, n), np.linspace(*chroma, n), (start + np.linspace(0, width, n)) % 360)
        seen = pd.DataFrame(dict(zip(("lightness", "chroma", "hue"), (axis.ravel() for axis in grid), strict=True)))
        assert set(colour_name(seen.assign(metallic=bool(metal)))) == {word}


def test_each_step_and_each_ten_of_colour_beyond_a_range_count_one():
    wanted = row((40, 60), (10, 20), None, (0, 1), 0)
    for position, expected in (
        (at(50, 15, 77), 0), (at(70, 15, 0), 1), (at(50, 40, 0), 2), (at(50, 15, 0, 3), 2), (at(50, 15, 0, 1, 1), 1),
    ):  # fmt: skip
        assert torch.isclose(misfit(position, wanted), torch.tensor(float(expected)))
        assert misfit(position, OPEN) == 0


def test_hues_run_round():
    wanted = row(hue=(350, 20))
    assert misfit(at(50, 30, 355), wanted) == misfit(at(50, 30, 10), wanted) == 0
    assert torch.isclose(misfit(at(50, 30, 340), wanted), misfit(at(50, 30, 30), wanted))
    assert misfit(at(50, 0, 180), wanted) == 0  # grey has no hue


@given(st.integers(0, 2**31))
def test_colours_are_moved_into_their_ranges_and_stay_where_they_are_within(seed):
    generator = torch.Generator().manual_seed(seed)
    positions = torch.rand(8, 5, generator=generator) * torch.tensor([100.0, 100, 360, 0, 0])
    wanted = torch.stack([word_row(COLOURS[k % len(COLOURS)]) for k in range(seed % 7, seed % 7 + 8)])
    moved = colours_within(positions, wanted)
    inside = torch.cat([moved, torch.zeros(8, 2)], 1)
    colours_only = wanted.clone()
    colours_only[:, [3, 4, 8, 9]] = float("nan")
    assert (misfit(inside, colours_only) < 1e-4).all()
    assert torch.equal(colours_within(inside, colours_only), moved)


@given(st.tuples(*[st.integers(0, 255)] * 3))
def test_a_colour_lies_in_the_middle_of_its_row_and_back_again(rgb):
    rgb = np.array(rgb) / 255
    wanted = colour_row(rgb)
    low, high = wanted.view(2, 5)
    hue = 0.0 if low[2].isnan() else (low[2] + 8) % 360
    upper = high[1] - (4 + 0.12 * (high[1] - 4) / 1.12)
    middle = torch.tensor([[high[0] - 6, upper, hue]])
    linear = np.where(rgb > 0.04045, ((rgb + 0.055) / 1.055) ** 2.4, rgb / 12.92)
    assert misfit(torch.cat([middle[0], torch.zeros(2)]), wanted) < 1e-3
    if not low[2].isnan():
        assert np.abs(linear_rgb(middle)[0].numpy() - linear).max() < 0.02
