import math

import numpy as np
import pytest
import torch

from neumat.errors import NeumatError
from neumat.fields.layout import permute_channels
from neumat.metrics.appearance import WHITE, appearance
from neumat.metrics.words import COLOURS, colour_name, colour_right, gloss_name, gloss_right

RED = (0.25, 0.02, 0.02)


@pytest.fixture
def seen(field):
    def look(**material):
        return appearance(field(**material)[None])

    return look


def test_a_lambertian_red_is_red_and_matte(seen):
    found = seen(albedo=RED)
    assert colour_name(found) == ["red"] and gloss_name(found) == ["matte"]
    assert colour_right(found, "red").all() and gloss_right(found, "dull").all()
    assert not colour_right(found, "green").any() and not gloss_right(found, "shiny").any()
    row = found.iloc[0]
    np.testing.assert_allclose(row[["diffuse_r", "diffuse_g", "diffuse_b"]].astype(float), RED, rtol=1e-3)
    np.testing.assert_allclose(row[["albedo_r", "albedo_g", "albedo_b"]].astype(float), RED, rtol=0.02)
    assert row["half_width"] == row["spread"] == math.pi / 2 and not row["metallic"]
    assert row["peak_5"] == pytest.approx(0.2126 * 0.25 / math.pi + 0.7874 * 0.02 / math.pi, rel=1e-3)


def test_a_permuted_red_is_the_permuted_colour(field):
    found = [permute_channels(field(albedo=RED), order)[None] for order in ("brg", "gbr")]
    assert colour_name(appearance(torch.cat(found))) == ["green", "blue"]


def test_white_gray_and_black_are_relative_to_the_brightest_materials(seen):
    names = [colour_name(seen(albedo=share * WHITE))[0] for share in (1.0, 0.25, 0.01)]
    assert names == ["white", "gray", "black"]


@pytest.mark.parametrize(
    ("albedo", "colour"),
    [
        ((0.30, 0.11, 0.01), "orange"),
        ((0.32, 0.26, 0.01), "yellow"),
        ((0.02, 0.20, 0.22), "turquoise"),
        ((0.12, 0.01, 0.20), "purple"),
        ((0.32, 0.14, 0.17), "pink"),
        ((0.07, 0.03, 0.015), "brown"),
    ],
)
def test_colours_have_the_names_that_a_person_gives_them(seen, albedo, colour):
    assert colour_name(seen(albedo=albedo)) == [colour]


def test_a_sharp_highlight_without_a_body_is_a_mirror(seen):
    mirror = seen(peak=90.0, fall=100.0)
    assert gloss_name(mirror) == ["mirror"] and mirror["metallic"].all() and colour_name(mirror) == ["silver"]
    assert gloss_right(mirror, "glossy").all() and gloss_right(mirror, "metallic").all()
    # f + 1 = 91 exp(-100 sin theta_h) is 46 where sin theta_h = log(91 / 46) / 100; the profile's steps are that wide.
    assert mirror["half_width"][0] == pytest.approx(math.log(91 / 46) / 100, abs=6e-4)


def test_a_highlight_on_a_body_is_glossy_or_satin_by_its_width(seen):
    glossy, satin = seen(albedo=RED, peak=20.0, fall=100.0), seen(albedo=RED, peak=1.0, fall=4.0)
    assert gloss_name(glossy) == ["glossy"] and gloss_name(satin) == ["satin"]
    assert colour_name(glossy) == ["red"] and not glossy["metallic"].any()
    assert glossy["spread"][0] < satin["spread"][0]


def test_what_is_called_a_colour_is_right_for_it(seen):
    generator = np.random.default_rng(0)
    for albedo in generator.uniform(0, WHITE, (20, 3)).astype(np.float32):
        found = seen(albedo=albedo)
        right = [word for word in COLOURS if colour_right(found, word)[0]]
        assert colour_name(found)[0] in right and len(right) <= 5


def test_unknown_words_are_refused(seen):
    for judge in (colour_right, gloss_right):
        with pytest.raises(NeumatError, match=r"word: expected one of .*; found 'sticky'"):
            judge(seen(), "sticky")


def test_what_is_not_finite_is_refused(field):
    with pytest.raises(
        NeumatError, match=r"weights: expected materials that are valid .*; found 1 that are not finite"
    ):
        appearance(torch.stack([field(albedo=0.5), field(albedo=math.nan)]))
