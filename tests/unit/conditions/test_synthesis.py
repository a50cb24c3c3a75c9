"""What a Synthesiser asks of a request before it encodes anything, and which candidates it serves."""

from types import SimpleNamespace

import pytest
import torch
from torch.nn.functional import normalize

from neumat.conditions import synthesis
from neumat.conditions.appearance import rendered_appearance
from neumat.conditions.descriptions import Descriptions, encoded_descriptions
from neumat.conditions.ranges import row, word_row
from neumat.conditions.synthesis import Synthesiser, check_numbers, scale
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE
from neumat.generative.conditional import MODALITIES
from neumat.metrics.appearance import appearance
from neumat.metrics.words import colour_right
from neumat.render.sphere import FrozenSphere


@pytest.mark.parametrize(
    ("request_", "expected"),
    [
        ({"text": ""}, "an empty text"),
        ({"text": " \t\n"}, "an empty text"),
        ({"text": "✨ !"}, "signs only"),
        ({"text": 5}, "found 5"),
        ({"text": "caf\udce9"}, "Unicode"),
        ({"image": torch.rand(32, 32, 3)}, "uint8"),
        ({"image": torch.zeros(32, 32, 3, dtype=torch.uint8)}, "one even colour"),
        ({"type": "wombat"}, "one of felt"),
    ],
)
def test_what_is_no_request_ends_in_one_line(request_, expected):
    synthesiser = Synthesiser.__new__(Synthesiser)
    synthesiser.types, synthesiser.encoder = ["felt"], None
    with pytest.raises(NeumatError, match=expected) as error:
        synthesiser.encode(**request_)
    str(error.value).encode()  # can be printed
    assert "\n" not in str(error.value)


def test_guidance_is_the_least_of_what_is_asked_for():
    request = {"text": None, "image": None}
    assert scale({"text": 2.0, "image": 0.5, "type": -1.0}, request) == 0.5
    assert scale(3.0, request) == 3.0
    assert scale(dict.fromkeys(MODALITIES, 2.0), {}) == 0.0


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, (0.25, 6)),
        ({"guidance": 3.0}, (3.0, 6)),
        ({"candidates": 5}, (0.25, 10)),
        ({"guidance": {"text": -1.0}}, (-1.0, 6)),
    ],
)
def test_requests_are_served_as_the_model_was_configured_where_they_do_not_say(given, expected, lambert):
    drawn = []

    class Model:
        def candidates(self, n, seed, request, guidance, start):
            drawn.append((guidance, n))
            return lambert(0.5).expand(n, -1), n

    served = Synthesiser.__new__(Synthesiser)
    served.model, served.guidance, served.candidates = Model(), {"text": 0.25, "type": 9.0}, 3
    served.encode = lambda text: {"text": torch.zeros(1, 4)}
    served.embed = lambda asked: asked
    served.start = lambda *_: None
    served.recoloured = lambda weights, asked: weights
    served.best = lambda weights, asked, n: weights[:, :n]
    served.synthesise(2, 0, text="red", **given)
    assert drawn == [expected]


def test_many_answers_are_made_a_few_at_a_time_and_every_text_is_answered_as_it_would_be_alone(monkeypatch):
    made = []

    def answers(asked, n, seed, guidance, candidates):
        made.append((n, seed))
        return asked["text"][:, :1, None] + torch.zeros(1, n, SIZE), 2 * n

    monkeypatch.setattr(synthesis, "AT_ONCE", 4)
    served = Synthesiser.__new__(Synthesiser)
    served.guidance, served.candidates, served.answers = {"text": 0.0}, 1, answers
    served.encode = lambda text: {"text": torch.tensor([[float(len(line))] for line in text])}
    weights, drawn = served.synthesise_each(["a", "bcd"], 6, 5)
    assert weights.shape == (2, 6, SIZE) and drawn == 24
    assert (weights[0] == 1).all() and (weights[1] == 3).all()
    assert [n for n, _ in made] == [4, 2, 4, 2]
    assert made[:2] == made[2:] and made[0][1] == 5 != made[1][1]


def test_an_answer_that_other_programs_show_wrong_is_replaced_by_one_to_the_same_request(lambert, leaning, monkeypatch):
    """Of two answers to each of two requests, the last cannot be mended at first."""
    drawn, rounds = [], []

    class Model:
        def candidates(self, n, seed, request, guidance, start):
            drawn.append((n, seed, guidance))
            return lambert(*request["category"][:, 0].tolist()), n

    def mended(weights):
        rounds.append(weights)
        return torch.cat([weights[:-1], leaning(1.0)[None]]) if len(rounds) == 1 else weights

    monkeypatch.setattr("neumat.generative.anew.mended", mended)
    served = Synthesiser.__new__(Synthesiser)
    served.model, served.embed = Model(), lambda asked: asked
    asked = {"category": torch.tensor([[0.2], [0.7]])}
    weights, count = served.answers(asked, 2, 0, {"category": 2.0}, 16)
    assert torch.equal(weights, lambert(0.2, 0.2, 0.7, 0.7).view(2, 2, -1))
    assert count == 5 and [(n, guidance) for n, _, guidance in drawn] == [(4, 2.0), (1, 1.0)]
    assert drawn[0][1] != drawn[1][1]


@pytest.mark.parametrize(
    ("numbers", "words"),
    [((0, 1.0, 1), "n: expected at least 1"), ((1, 1.0, 0), "candidates"), ((1, -2.0, 1), "guidance"),
     ((1, float("nan"), 1), "guidance"), ((1, {"text": float("inf")}, 1), "guidance")],
)  # fmt: skip
def test_numbers_that_cannot_be_are_refused_before_anything_is_encoded(numbers, words):
    with pytest.raises(NeumatError, match=words):
        check_numbers(*numbers)


RED, GREEN, BLUE = (0.5, 0.05, 0.05), (0.05, 0.5, 0.05), (0.05, 0.05, 0.5)


@pytest.fixture
def judging():
    """A Synthesiser without a model; embeddings are the pictures' mean colours, appearance is predicted as encoded."""
    synthesiser = Synthesiser.__new__(Synthesiser)
    synthesiser.camera = FrozenSphere(48, 16, 32)
    synthesiser.images = lambda pictures: normalize(pictures.float().mean((1, 2)), dim=1)
    synthesiser.embed = lambda asked: asked
    synthesiser.appearance = lambda features: features
    return synthesiser


def wordless(judging):
    """The same, to which descriptions say nothing of a text."""
    judging.descriptions = SimpleNamespace(
        of=lambda seen: torch.zeros(len(seen), 1), centred=lambda texts: torch.zeros(len(texts), 1)
    )
    return judging


def test_each_request_gets_those_of_its_candidates_whose_pictures_fit(judging, lambert):
    weights = lambert(RED, GREEN, BLUE, GREEN, BLUE, RED).view(2, 3, -1)
    text = normalize(torch.tensor([GREEN, BLUE]), dim=1)
    for asked in ({"image": rendered_appearance(lambert(GREEN, BLUE))}, {"text": text, "image": text}):
        found = wordless(judging).best(weights, asked, 1)
        assert torch.equal(found, lambert(GREEN, BLUE)[:, None])
    assert torch.equal(judging.best(weights, {"type": torch.ones(2, 1)}, 2), weights[:, :2])


def test_of_good_answers_the_different_ones_are_served(judging, lambert):
    """Of 16, four fit, two of which are alike; the others differ more but do not fit."""
    dark, darker = (0.25, 0.025, 0.025), (0.125, 0.0125, 0.0125)
    weights = lambert(*[GREEN, BLUE] * 6, RED, RED, dark, darker)[None]
    red = normalize(torch.tensor([RED]), dim=1)
    found = wordless(judging).best(weights, {"text": red, "image": red}, 2)
    assert set(map(tuple, found[0].tolist())) == set(map(tuple, lambert(RED, dark).tolist()))


def test_answers_to_a_picture_begin_with_different_materials_that_look_like_it(judging, lambert):
    dim, dark = (0.4, 0.04, 0.04), (0.25, 0.025, 0.025)
    judging.weights = lambert(BLUE, dark, RED, GREEN, dim)
    asked = {"image": rendered_appearance(lambert(RED, BLUE))}
    fields, level = judging.start(asked, 2, 1)
    fields = fields.view(2, 2, -1)
    assert torch.equal(fields[0], lambert(RED, dim))
    assert torch.equal(fields[1, 0], lambert(BLUE)[0])
    assert level > 0
    assert len(judging.start(asked, 7, 1)[0]) == 14  # more than there are
    for other in ({"type": asked["image"]}, asked | {"text": asked["image"]}, {}):
        assert judging.start(other, 2, 3) is None


def test_answers_to_a_text_begin_with_different_materials_each_in_its_best_order(judging, lambert, toy):
    judging.weights = lambert(BLUE, RED, GREEN, (0.3, 0.3, 0.3), (0.05, 0.05, 0.05))
    judging.positions, judging.embedded = torch.tensor([0, 0, 0, 1, 2]), torch.zeros(5, toy.WORDS)
    judging.descriptions = Descriptions(encoded_descriptions(toy()))
    fields, level = judging.start({"text": toy().encode_text(["matte red material"])}, 2, 2)
    assert torch.equal(fields[0], lambert(RED)[0]) and level > 0
    assert len({tuple(field.tolist()) for field in fields}) == 3 and torch.equal(fields[3], fields[0])


def test_candidates_take_the_colours_that_are_wanted_and_what_fits_stays(judging, lambert):
    weights = lambert((0.16, 0.02, 0.02), GREEN, BLUE, (0.1, 0.1, 0.1))[None]
    asked = {"wanted": word_row("red")[None]}
    found = judging.recoloured(weights, asked)
    assert torch.equal(found[0, 0], weights[0, 0])
    assert colour_right(appearance(found[0]), "red").all()
    assert torch.equal(judging.recoloured(weights, {"wanted": row()[None]}), weights)


def test_candidates_take_the_colour_that_a_picture_shows(judging, lambert):
    target = rendered_appearance(lambert((0.2, 0.1, 0.05)))
    found = judging.recoloured(lambert((0.1, 0.1, 0.1), (0.05, 0.2, 0.2))[None], {"image": target})
    assert (rendered_appearance(found[0]) - target).abs().max() < 0.02


def test_training_materials_are_rendered_once_and_their_pictures_permuted_as_they_are(judging, lambert):
    judging.weights = lambert(RED, BLUE, (0.1, 0.3, 0.2), GREEN, (0.3, 0.2, 0.1))
    assert torch.equal(judging.rendered, rendered_appearance(judging.weights))


def test_those_most_like_a_picture_are_served(judging, lambert):
    dim = (0.4, 0.04, 0.04)
    weights = lambert(BLUE, dim, GREEN, GREEN, RED, BLUE)[None]
    found = judging.best(weights, {"image": rendered_appearance(lambert(RED))}, 2)
    assert torch.equal(found[0], lambert(RED, dim))


def test_what_is_called_as_the_text_says_wins_and_no_picture_is_looked_at(judging, toy, lambert):
    judging.images = None
    judging.descriptions = Descriptions(encoded_descriptions(toy()))
    weights = lambert(RED, GREEN, BLUE)[None]
    for text, expected in (("red thing", RED), ("a matte blue thing", BLUE), ("green", GREEN)):
        (found,) = judging.best(weights, {"text": toy().encode_text([text])}, 1)
        assert torch.equal(found, lambert(expected))
