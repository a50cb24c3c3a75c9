"""Which words of a text are understood as colour, gloss and things."""

import pytest
import torch

from neumat.conditions.colour_names import read_colour
from neumat.conditions.ranges import colour_row, row, word_row
from neumat.conditions.wanted import Vocabulary
from neumat.errors import NeumatError

SNOW = row((88, 100), (0, 5), None, (0, 1), 0)
THINGS = {("snow", "fresh snow"): SNOW, ("rust",): row((20, 40), (20, 40), (40, 60), (0, 0), 0)}


@pytest.fixture(scope="module")
def read():
    return Vocabulary(THINGS).read


def same(a, b):
    return torch.equal(a.nan_to_num(-1), b.nan_to_num(-1))


def ends(reading, axis):
    return reading.wanted.view(2, 5)[:, axis].tolist()


def test_a_thing_is_described_by_plain_words_before_it(read):
    reading = read("Fresh snow")
    assert same(reading.wanted, SNOW) and reading.words == 1
    assert reading.plain == "matte white Fresh snow"


def test_what_is_said_goes_before_what_is_known(read):
    reading = read("glossy blue snow")
    assert same(reading.wanted[:3], word_row("blue")[:3]) and ends(reading, 3) == [2, 3] and ends(reading, 4) == [0, 0]
    assert reading.plain == "glossy blue snow"


@pytest.mark.parametrize("text", ["navy blue silk", "Navy-Blue silk", "navy-blue coloured silk"])
def test_names_of_colours_are_colours_and_told_in_plain_words(read, text):
    reading = read(text)
    assert same(reading.wanted, colour_row(read_colour("navy blue"))) and reading.plain == "blue silk"


def test_numbers_and_things_as_colours(read):
    assert same(read("#ff8800 plastic").wanted, colour_row((1, 0x88 / 255, 0)))
    assert read("#ff8800 plastic").plain == "orange plastic"
    rusty = read("rust-coloured velvet")
    assert ends(rusty, 0) == [20, 40] and torch.isnan(rusty.wanted[3])


def test_what_is_denied_is_avoided_and_not_read(read):
    reading = read("a shiny metal, not red")
    assert same(reading.avoided[:3], word_row("red")[:3]) and reading.plain == "a shiny metal,"
    assert ends(reading, 4) == [1, 1]
    assert read("not red").plain == "material"
    assert read("red plastic, not expensive").avoided.isnan().all()


def test_contradictions_are_told_and_agreement_is_not(read):
    assert "colour" in read("red and blue plastic").told[0]
    assert "gloss" in read("matte mirror").told[0]
    for text in ("red crimson plastic", "shiny glossy metal", "red plastic", "white snow", "snow"):
        assert not read(text).told


def test_plurals_are_known_and_other_words_are_not(read):
    assert read("snows").words == 1
    assert read("dusty leather thistledown").words == 0


@pytest.mark.parametrize("text", ["#12345", "#ggg", "blurgh", "", 5])
def test_what_is_no_colour_ends_in_one_line(text):
    with pytest.raises(NeumatError, match="#b87333") as error:
        read_colour(text)
    assert "\n" not in str(error.value)


def test_colours_by_number_and_name():
    assert read_colour("#F80") == read_colour(" #ff8800 ") == (1, 0x88 / 255, 0)
    assert read_colour("Navy-Blue") == read_colour("navy blue") != read_colour("navy")
