"""What is looked up among known materials, by a score that is given."""

from types import SimpleNamespace

import pandas as pd
import torch

from neumat.conditions.choice import Seen
from neumat.conditions.ranges import misfit, row, seen, word_row
from neumat.conditions.things import held_out
from neumat.fields.layout import SIZE
from neumat.metrics.appearance import appearance
from neumat.metrics.materials import MaterialSet
from neumat.studies.look_up import LookUp, in_colours_of
from neumat.studies.things import things_table

RED, GREEN, BLUE, DARK = (0.16, 0.02, 0.02), (0.02, 0.16, 0.02), (0.02, 0.02, 0.2), (0.08, 0.01, 0.01)


def synthesiser():
    """One that tells materials apart by what is wanted of them alone, and paints candidates red."""
    return SimpleNamespace(
        seen=lambda weights, asked: Seen(seen(appearance(weights)), torch.zeros(len(weights), 1)),
        fit=lambda found, asked: -misfit(found.positions, asked["wanted"][:, None]),
        recoloured=lambda weights, asked: weights if asked["wanted"].isnan().all() else torch.full_like(weights, 7),
        best=lambda weights, asked, n: weights[:, :n],
    )


def test_those_that_fit_are_looked_up(lambert):
    found = LookUp(synthesiser(), lambert(BLUE, RED, GREEN, DARK))
    asked = {"text": torch.zeros(2, 1), "wanted": torch.stack([word_row("green"), word_row("blue")])}
    assert torch.equal(found.answers(asked, 1, 1), lambert(GREEN, BLUE)[:, None])
    both = found.answers(asked, 2, 4)
    assert both.shape == (2, 2, SIZE) and all(len(answers.unique(dim=0)) == 2 for answers in both)


def test_recoloured_ones_are_as_many_as_a_model_has_candidates_whatever_their_colour(lambert):
    found = LookUp(synthesiser(), lambert(BLUE, RED, GREEN, DARK))
    asked = {"text": torch.zeros(1, 1), "wanted": word_row("green")[None]}
    assert (found.recoloured(asked, 2, 2) == 7).all()


def test_materials_take_the_colours_of_others(lambert):
    weights = lambert(BLUE, RED)
    made = appearance(in_colours_of(weights, appearance(lambert(GREEN, BLUE))))
    expected = appearance(lambert(GREEN, BLUE))
    assert (made["hue"] - expected["hue"]).abs().max() < 2 and (
        made["lightness"] - expected["lightness"]
    ).abs().max() < 2


def test_answers_within_the_ranges_of_things_are_counted(lambert):
    """Things known and held out; of each all answers are red."""
    names = [f"thing {k}" for k in range(9)]
    held = {own[0] for own in held_out({(name,): None for name in names})}
    red = row((10, 60), (30, 120), (5, 60), None, 0)
    things = {(name,): red if name in held else word_row("blue") for name in names}
    answers = lambert(RED)[0]

    def made(asked, n, *_):
        return answers.expand(len(asked["wanted"]), n, -1)

    asked = synthesiser()
    asked.read_texts = lambda texts, force: {"wanted": torch.stack([row()] * len(texts))}
    asked.answers = lambda asked, n, *_: (made(asked, n), 0)
    asked.encoder = SimpleNamespace(encode_text=lambda texts: torch.ones(len(texts), 2))
    asked.model = SimpleNamespace(sample=lambda n, seed, request: (answers.expand(n, -1), n))
    same = SimpleNamespace(answers=made, recoloured=made)
    bench = SimpleNamespace(
        synthesiser=asked, look_up=same, plain_look_up=same,
        materials=lambda weights: MaterialSet(torch.arange(2), torch.zeros(len(weights), 2, 3)),
    )  # fmt: skip
    table = things_table(bench, things, 2, 0.0, 1, 0)
    within = table[table["measure"] == "within its ranges, all"].groupby("things")["value"].unique()
    assert within["held out"].tolist() == [1] and within["known"].tolist() == [0]
    assert isinstance(table, pd.DataFrame) and set(table["count"]) == {len(held), len(names) - len(held)}
