"""Texts as users write them: what of one the encoder can read, and what it may not understand."""

import itertools
import logging
import re
import unicodedata

from neumat.conditions.texts import COLOURS, GLOSS
from neumat.errors import NeumatError

FAMILIAR = 0.72  # cosine above which words that an encoder knows in pieces only are understood nevertheless
FARTHEST = 0.5  # cosine to the nearest training caption, below which a text is not about materials
SIGNS = ("Cf", "Co", "Cn", "Me")  # categories of Unicode, beside those of symbols
NEGATIONS = re.compile(r"\b(not|no|never|without|neither|nor|cannot|\w+n['’]t)\b", re.IGNORECASE)
# Frequent words of other languages that the encoder's pieces hold, and English has not: articles, colours, stuffs.
FOREIGN = frozenset(
    """
    der das ein eine und mit aus rot blau gelb schwarz weiss grau braun holz les une et avec bois rouge bleu bleue
    vert verte jaune noir noire blanc blanche grise brun cuir los las una con del rojo roja azul verde amarillo negra
    blanco blanca madera gli rosso rossa blu giallo nero nera bianco bianca grigio legno vermelho preto branco het een
    """.split()
)
WORD = re.compile(r"[^\W\d_]+")
PLAIN = frozenset(WORD.findall(" ".join(itertools.chain(*COLOURS.values(), *GLOSS.values()))))  # whatever their pieces
EMPTY_BRACKETS = re.compile(r"\(\s*\)|\[\s*\]|\{\s*\}")


def check_text(text):
    """Raise NeumatError for what is no text to ask with: without one letter or digit, there is nothing to read."""
    if not isinstance(text, str):
        raise NeumatError("text", "words", repr(text))
    if not text.strip():
        raise NeumatError("text", "words", "an empty text")
    if any("\ud800" <= letter <= "\udfff" for letter in text):  # as Python reads bytes that are not UTF-8
        raise NeumatError("text", "Unicode", f"{text[:40]!r}")
    if not any(letter.isalnum() for letter in text):
        raise NeumatError("text", "words", f"signs only, {text[:40]!r}")


def readable_text(text, encoder):
    """Return what an encoder reads of a text: without signs, and letters of which it has none; cut at its limit.

    Warns of letters that are left out, of a cut, and of negations, which the encoders take for what they negate. Raises
    NeumatError as `check_text` does, and where nothing is left.
    """
    check_text(text)
    plain = "".join(" " if _is_sign(letter) else letter for letter in text)
    known = _without(plain, _unknown(plain, encoder))
    pieces = encoder.pieces(known)
    read = known[: pieces[encoder.longest - 1][1]] if len(pieces) > encoder.longest else known
    if not any(letter.isalnum() for letter in read):
        raise NeumatError("text", "words that the encoder can read (English)", f"{text[:40]!r}")
    lost = sorted({letter for letter in plain if letter.isalnum()} - set(known))
    if lost:
        logging.warning("text %.40r: %s can't be read, and is left out", text, ", ".join(lost[:10]))
    if read != known:
        logging.warning("text %.40r: only its first %d word pieces are read, of %d", text, encoder.longest, len(pieces))
    if negated := NEGATIONS.search(read):
        logging.warning("text %.40r: %r may not be understood: say what it is instead", text, negated[0])
    return read


def unknown_words(text, encoder):
    """Return (the words of a text that look foreign to an encoder, how many words there are): they have letters that
    English has not, the encoder knows them in pieces only, or they are FOREIGN."""
    words = [match.span() for match in WORD.finditer(text)]
    whole = {(start, end) for start, end, known in encoder.pieces(text) if known}
    unknown = [
        text[start:end]
        for start, end in words
        if text[start:end].lower() not in PLAIN
        and (not text[start:end].isascii() or (start, end) not in whole or text[start:end].lower() in FOREIGN)
    ]
    return unknown, len(words)


def comment(text, known, reading, nearest, encoder, force):
    """Warn of what is not understood of a text; raise NeumatError where nothing is, unless `force`.

    known: what the encoder reads of it, reading: see `wanted`, nearest: its cosine to the nearest training caption.
    """
    unknown, words = unknown_words(known, encoder)
    foreign = 2 * len(unknown) >= max(1, words) and nearest < FAMILIAR
    if not (reading.words or force) and (foreign or nearest < FARTHEST):
        expected = "English words for a material, its colour or its gloss (or --force)"
        raise NeumatError("text", expected, f"{text[:40]!r}, of which nothing is known")
    for line in reading.told:
        logging.warning("text %.40r: %s", text, line)
    if nearest < FARTHEST and not reading.words:
        logging.warning("text %.40r: unlike any description of a material (similarity %.2f)", text, nearest)
    elif unknown and nearest < FAMILIAR:
        foreign = ", ".join(unknown[:10])
        logging.warning("text %.40r: %s may not be understood: say it in other English words", text, foreign)


def _is_sign(letter):
    """Return whether a character says nothing of a material: symbols but ASCII's, what encloses or selects one, what
    can't be seen, and what is private or unassigned."""
    category = unicodedata.category(letter)
    return (category[0] == "S" and not letter.isascii()) or category in SIGNS or "\ufe00" <= letter <= "\ufe0f"


def _unknown(text, encoder):
    """Return the positions of letters that an encoder can't read: of each piece that it has not, those which it has not
    by themselves either, or else all."""
    positions = set()
    for start, end, known in encoder.pieces(text):
        if not known:
            alone = {k for k in range(start, end) if any(not piece[2] for piece in encoder.pieces(text[k]))}
            positions |= alone or set(range(start, end))
    return positions


def _without(text, positions):
    """Return a text without the letters at these positions, empty brackets and double spaces."""
    kept = "".join(" " if k in positions else letter for k, letter in enumerate(text))
    return " ".join(EMPTY_BRACKETS.sub(" ", kept).split())
