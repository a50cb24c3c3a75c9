import logging
import re

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.conditions.encoders import Packaged
from neumat.conditions.synthesis import Synthesiser
from neumat.conditions.text_input import check_text, readable_text, unknown_words
from neumat.conditions.wanted import Vocabulary
from neumat.errors import NeumatError

SIGNS = ("✨", "🔴", "™", "❤️", "👩‍🎨", "\u200b", "\ufeff", "→✓", "🇫🇷", "\ue000", "㊙")


class Words:
    """An encoder that reads at most eight of these words; of others it knows the letters a to z."""

    longest = 8
    KNOWN = ("a", "red", "blue", "metal", "shiny", "plastic", "very", "without", "not", "isn", "t")

    def pieces(self, text):
        found = []
        for match in re.finditer(r"\w+|[^\w\s]", text):
            start, end = match.span()
            if match[0].lower() in self.KNOWN or not match[0].isalnum():
                found.append((start, end, True))
            elif match[0].isascii():
                found += [(k, k + 1, True) for k in range(start, end)]
            else:
                found.append((start, end, False))
        return found


def read(text, encoder=None):
    """Return what is read of a text, and what is told of it."""
    told = []
    handler = logging.Handler()
    handler.emit = lambda record: told.append(record.getMessage())
    logging.getLogger().addHandler(handler)
    try:
        return readable_text(text, encoder or Words()), told
    finally:
        logging.getLogger().removeHandler(handler)


@pytest.mark.parametrize("sign", SIGNS)
def test_signs_change_nothing_and_are_nothing_to_ask_for(sign):
    for text in (
        f"red metal {sign}",
        f"{sign} red metal",
        f"red {sign} metal",
        f"red metal{sign}",
        f"red metal ({sign})",
    ):
        assert read(text) == ("red metal", [])
    for text in (sign, sign * 3, f" {sign}!? "):
        with pytest.raises(NeumatError, match="expected words; found signs only") as caught:
            check_text(text)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("letters", ["金", "красный", "ß"])
def test_letters_that_the_encoder_has_not_are_left_out_and_told(letters):
    text, told = read(f"red metal ({letters})")
    assert text == "red metal" and len(told) == 1 and "can't be read" in told[0]
    with pytest.raises(NeumatError, match="words that the encoder can read"):
        read(letters)


def test_the_limit_counts_word_pieces_and_a_cut_is_told():
    assert read("very " * 7 + "red") == (("very " * 7 + "red"), [])
    for text, kept in (("very " * 8 + "red", "very " * 8), ("shinyish red", "shinyish"), ("x" * 50 + " red", "x" * 8)):
        found, told = read(text)
        assert found == kept.strip() and len(told) == 1 and "first 8 word pieces are read" in told[0]


def test_a_text_of_which_only_signs_are_within_the_limit_is_refused():
    with pytest.raises(NeumatError, match="words that the encoder can read"):
        read(": " * 8 + "red")


@pytest.mark.parametrize("text", ["not red", "metal, NOT shiny", "isn't red", "a metal without red", "no plastic"])
def test_negations_are_told(text):
    assert any("may not be understood" in line for line in read(text)[1])


def test_words_that_only_look_like_negations_are_not_told():
    for text in ("knot", "notable red", "non-reflective"):
        assert not any("understood" in line for line in read(text)[1])


@pytest.mark.parametrize(
    ("text", "unknown"),
    [
        ("a shiny red metal", []),
        ("a shiny red foil", ["foil"]),
        ("rotes Blech", ["rotes", "Blech"]),
        ("métal red", ["métal"]),
    ],
)
def test_what_is_known_in_pieces_or_written_in_other_letters_is_unknown(text, unknown):
    assert unknown_words(text, Words()) == (unknown, len(text.split()))


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=40))
def test_any_text_is_read_within_the_limit_or_refused_in_one_line(text):
    try:
        found, _ = read(text)
    except NeumatError as error:
        assert "\n" not in str(error)
        str(error).encode()
        return
    pieces = Words().pieces(found)
    assert 0 < len(pieces) <= Words.longest and all(known for *_, known in pieces)
    assert read(found)[0] == found


@pytest.fixture(scope="module")
def packaged():
    """A Synthesiser of the packaged encoder, without a model."""
    synthesiser = Synthesiser.__new__(Synthesiser)
    synthesiser.encoder, synthesiser.vocabulary = Packaged(), Vocabulary({})
    captions = ["red metal", "blue metal", "a shiny red plastic", "green fabric", "red", "a matte blue paint"]
    synthesiser.captions = synthesiser.encoder.encode_text(captions)
    return synthesiser


def test_the_packaged_encoder_reads_what_it_says_it_does(packaged, caplog):
    encoder = packaged.encoder
    plain = encoder.encode_text(["red metal"])[0]
    for text in ("red metal 🔥", "🔥 red metal", "red metal®", "red metal (银)"):
        assert torch.allclose(packaged.encode_texts([text])[0], plain, atol=1e-5)
    for text in ("银", "🔵", "赤"):
        with pytest.raises(NeumatError):
            packaged.encode_texts([text])
    # What lies beyond the limit changes nothing, and what lies before it does.
    for word in ("red", "semitransparent"):
        pieces = len(encoder.pieces(word))
        fits = encoder.longest // pieces - 1
        ends = [
            encoder.encode_text([f"{word} " * (fits + more) + end])[0] for more in (0, 20) for end in ("red", "blue")
        ]
        assert not torch.allclose(ends[0], ends[1], atol=1e-4) and torch.allclose(ends[2], ends[3], atol=1e-4)
        caplog.clear()
        packaged.encode_texts([f"{word} " * (fits + 20)], force=True)
        assert any("word pieces are read" in line for line in caplog.messages)


@pytest.mark.parametrize(
    "text",
    ["roter Kunststoff", "métal vert brillant", "plástico rojo", "красный металл", "xqzv blorptang", "bois verni"],
)
def test_other_languages_and_random_letters_are_refused_unless_forced(packaged, caplog, text):
    with pytest.raises(NeumatError, match="nothing is known") as error:
        packaged.encode_texts([text])
    assert "\n" not in str(error.value) and "--force" in str(error.value)
    packaged.encode_texts([text], force=True)
    assert caplog.messages


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("plastic, not expensive", "may not be understood"),
        ("red and blue metal", "contradicts itself in colour"),
        ("red metal rouge roja lana", "rouge, roja"),
    ],
)
def test_what_cannot_be_followed_is_told(packaged, caplog, text, part):
    packaged.encode_texts([text])
    assert any(part in line for line in caplog.messages), caplog.messages


def test_plain_requests_are_not_commented_on(packaged, caplog):
    packaged.encode_texts(
        ["red metal", "shiny red plastic", "blue metal", "a matte blue paint", "Red metal!", "metal, not red"]
    )
    assert not caplog.messages
