"""The table of things: its ranges are narrow, and its mistakes are told."""

from pathlib import Path

import pandas as pd
import pytest
import torch

from neumat.conditions.ranges import misfit, row
from neumat.conditions.texts import captions
from neumat.conditions.things import COLUMNS, held_out, known_things, likenesses, packed, read_things, unpacked
from neumat.errors import NeumatError
from neumat.metrics.appearance import appearance

CONFIG = Path(__file__).parents[3] / "config"


@pytest.fixture(scope="module")
def things():
    return read_things(CONFIG / "things.tsv")


def test_there_are_many_things_of_which_a_third_is_held_out(things):
    assert len(things) >= 200
    held = held_out(things)
    assert 0.27 < len(held) / len(things) < 0.4
    assert known_things(things, unseen=False) == things
    assert things.keys() - known_things(things, unseen=True).keys() == set(held)


def test_half_of_the_ranges_hold_a_tenth_of_all_appearances_at_most(things):
    """Of appearances spread as evenly as can be over lightness, chroma, hue, gloss and metal."""
    u = torch.rand(4000, 5, generator=torch.Generator().manual_seed(0))
    everything = torch.stack(
        [100 * u[:, 0], 80 * u[:, 1] ** 2, 360 * u[:, 2], (4 * u[:, 3]).floor(), u[:, 4].round()], 1
    )
    held = torch.stack([(misfit(everything, ranges) == 0).float().mean() for ranges in things.values()])
    assert held.median() < 0.1


def test_packed_things_are_the_same(things):
    again = unpacked(packed(things))
    assert list(again) == list(things)
    for names, ranges in things.items():
        assert torch.equal(again[names].nan_to_num(-1), ranges.nan_to_num(-1))


def test_what_a_material_looks_like_is_told_and_captions_say_so(lambert):
    things = {("snow", "fresh snow"): row((80, 100), (0, 6)), ("soot",): row((0, 10), (0, 6))}
    found = likenesses(appearance(lambert(0.35, 0.001, 0.1)), things)
    assert found == [("snow",), ("soot",), ()]
    facts = pd.DataFrame({"name": list("abc"), "colour": "gray", "gloss": "matte", "thing": "paint", "family": ""})
    texts = captions(facts, 60, [], 0, found)
    said = [{name for name in ("snow", "soot") if any(name in text for text in own)} for own in texts]
    assert said == [{"snow"}, {"soot"}, set()]
    assert captions(facts, 60, [], 0)[2] == texts[2]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("snow\t\t\t80\t\tmatte\tno", ["lightness", "two numbers", "80"]),
        ("snow\t\t\t80-120\t\tmatte\tno", ["lightness", "100"]),
        ("snow\t\t\t\t\tshiny\tno", ["gloss", "matte", "shiny"]),
        ("snow\t\t\t\t\tmatte\tmaybe", ["metal", "maybe"]),
        ("\t\t\t\t\tmatte\tno", ["names"]),
        ("ice\tsnow\t\t\t\tmatte\t\nSnow\t\t\t\t\tmatte\tno", ["line 3", "Snow"]),
    ],
)
def test_mistakes_end_in_one_line(line, words, tmp_path):
    path = tmp_path / "things.tsv"
    path.write_text("\t".join(COLUMNS) + "\n" + line + "\n")
    with pytest.raises(NeumatError) as error:
        read_things(path)
    assert "\n" not in str(error.value) and all(word in str(error.value) for word in [*words, "things.tsv"])
