import re
from pathlib import Path

import pandas as pd
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.conditions.store import Conditions
from neumat.conditions.texts import COLOURS, GLOSS, captions, thing_of
from neumat.metrics import words as measured

CONFIG = Path(__file__).parents[3] / "config"
FACTS = pd.DataFrame(
    {
        "name": ["a", "b", "c"],
        "colour": ["red", "green", "gray"],
        "gloss": ["matte", "mirror", "glossy"],
        "thing": ["plastic", "mixture of steel and felt", "my paint"],
        "family": ["plastic", "", ""],
    }
)


def test_captions_say_nothing_untrue_of_the_colour_or_the_gloss():
    for row, texts in zip(FACTS.itertuples(), captions(FACTS, 200, [], seed=0), strict=True):
        for words, own in ((COLOURS, row.colour), (GLOSS, row.gloss)):
            false = {word for key, group in words.items() for word in group if word not in words[own]}
            # "specular" and "reflective" are parts of longer words of other groups.
            false -= {part for word in words[own] for part in word.split()}
            for text in texts:
                assert not any(re.search(rf"(?<![\w-]){word}(?![\w-])", text) for word in false), text


def test_unseen_prompts_are_kept_out():
    texts = captions(FACTS, 500, ["red plastic", "matte"], seed=0)[0]
    assert not any("red plastic" in text or text == "matte" for text in texts)
    assert any("matte" in text for text in texts)  # one word may occur, not be the whole caption


@settings(max_examples=30)
@given(st.data())
def test_no_prompt_of_the_table_is_in_a_caption(data):
    """Whatever a material is called, even as a prompt is."""
    prompts = list(pd.read_csv(CONFIG / "prompts.tsv", sep="\t")["prompt"])
    things = st.sampled_from([*prompts, *(prompt.title() for prompt in prompts), "plastic", "Felt"])
    row = {
        "name": data.draw(st.text(max_size=5)),
        "colour": data.draw(st.sampled_from([*COLOURS])),
        "gloss": data.draw(st.sampled_from([*GLOSS])),
        "thing": data.draw(things),
        "family": data.draw(st.sampled_from(["", "metal", "fabric", "rubber", "stone"])),
    }
    texts = captions(pd.DataFrame([row]), 20, prompts, seed=data.draw(st.integers(0, 99)))[0]
    assert len(texts) == 20 and not {text.lower() for text in texts} & set(prompts)
    assert not [text for text in texts for prompt in prompts if " " in prompt and prompt in text.lower()]


def test_captions_depend_on_the_seed_and_the_material_alone():
    assert captions(FACTS, 5, [], 1) == captions(FACTS, 5, [], 1) != captions(FACTS, 5, [], 2)
    assert captions(FACTS[1:], 5, [], 1) == captions(FACTS, 5, [], 1)[1:]


def test_blends_are_mixtures_and_unknown_sources_are_called_by_their_name():
    types = pd.DataFrame(
        {"description": ["steel", "felt"], "family": ["metal", "fabric"]}, index=["steel-1", "red-felt"]
    )
    rows = pd.DataFrame({"parent_a": ["steel-1", "steel-1", "my_car"], "parent_b": ["steel-1", "red-felt", "my_car"]})
    assert [thing_of(row, types) for row in rows.itertuples()] == [
        ("steel", "metal"), ("mixture of steel and felt", ""), ("my car", ""),
    ]  # fmt: skip


def test_every_colour_and_gloss_that_can_be_measured_can_be_said():
    assert tuple(COLOURS) == measured.COLOURS
    assert tuple(GLOSS) == measured.GLOSS


def test_every_colour_is_drawn_as_often():
    facts = pd.DataFrame({"colour": ["green", "green", "green", "red", "blue", "blue"]})
    share = Conditions("toy", [], torch.zeros(6, 0), facts, [], torch.zeros(6, 1, 2), torch.zeros(6, 1, 2)).even_colours
    assert share[:3].sum().item() == share[3].item() == share[4:].sum().item()
