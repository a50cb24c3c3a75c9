"""What a text asks of a material's appearance: its words for colours, gloss and things, as ranges; what it denies."""

import math
import re
from dataclasses import dataclass

import pandas as pd
import torch

from neumat.conditions.colour_names import HEX, every_name, of_hex, running_names
from neumat.conditions.ranges import AXES, OPEN, colour_row, gloss_range, misfit, row, word_row
from neumat.conditions.texts import COLOURS as COLOUR_WORDINGS
from neumat.conditions.texts import GLOSS as GLOSS_WORDINGS
from neumat.metrics.words import COLOURS, GLOSS, GLOSS_SYNONYMS, SYNONYMS, colour_name

TOKEN = re.compile(r"#[0-9a-f]+|[^\W_]+(?:['’][^\W_]+)*|[,.;:]", re.IGNORECASE)
LONGEST = 5  # words of a name
COLOURED = {"coloured", "colored", "colour", "color", "hued", "tinted"}
NEGATIONS = {"not", "no", "never", "without", "neither", "nor", "non", "isn't", "isn’t"}
ENDS = {"but", "and", ",", ".", ";", ":"}  # of what a negation denies
UNTOLD = {"dark", "pale", "drab", "bland", "velvet", "stone", "steel", "leather"}  # names of no one colour
COLOUR, GLOSS_AXES = slice(0, 3), slice(3, 5)
# Words for gloss beside those of `texts` and `metrics.words`.
GLOSS_RANGES = dict.fromkeys(("glossy", "polished", "varnished", "lacquered", "glazed"), ("glossy", "mirror"))
GLOSS_RANGES |= {"brushed": ("satin", "glossy"), "wet": ("satin", "mirror")}


@dataclass(frozen=True)
class Reading:
    """wanted, avoided: rows, see `ranges`, open where nothing is said; plain: the text for an encoder, with plain words
    for the names of colours and before those of things, and without what is denied; words: how many of its names are
    understood, of colours, gloss and things; told: lines on what could not be followed."""

    wanted: torch.Tensor
    avoided: torch.Tensor
    plain: str
    words: int
    told: tuple


class Vocabulary:
    """The words for appearance: those of `neumat.metrics.words`, the names of colours, and things, {names: row}."""

    def __init__(self, things):
        self.things = things
        self.entries = {tuple(name.split()): ("named", rgb) for name, rgb in running_names().items()}
        colours = dict(COLOUR_WORDINGS)
        for word, meant in SYNONYMS.items():
            colours[meant] = (*colours[meant], word)
        self._add("colour", colours, word_row)
        gloss = {word: GLOSS_WORDINGS[word] for word in GLOSS}
        for word, meant in GLOSS_SYNONYMS.items():
            gloss[meant] = (*gloss.get(meant, ("metallic",)), word)
        self._add("gloss", gloss, _gloss_row)
        self._add("gloss", {word: (word,) for word in GLOSS_RANGES}, _gloss_row)
        for names, ranges in things.items():
            for name in names:
                self.entries[_words(name)] = ("thing", ranges)

    def _add(self, kind, wordings, ranges):
        for word, ways in wordings.items():
            for way in (word, *ways):
                self.entries[_words(way)] = (kind, ranges(word))

    def read(self, text):
        """Return the Reading of a text."""
        tokens = [(match[0].lower(), match.span()) for match in TOKEN.finditer(text.replace("-", " "))]
        found, denied, replaced, told, k, negated = [], [], [], [], 0, None
        while k < len(tokens):
            word, (start, _) = tokens[k]
            if word in NEGATIONS:
                negated, k = start, k + 1
                continue
            kind, ranges, count = self._at([token for token, _ in tokens[k : k + LONGEST + 1]])
            end = tokens[k + max(count, 1) - 1][1][1]
            if negated is not None:
                if kind:
                    denied.append((kind, ranges))
                    replaced.append((negated, end, ""))
                    negated = None
                elif word in ENDS:
                    negated = None
            elif kind:
                found.append((kind, ranges, (start, end)))
            k += max(count, 1)
        if not denied and not {"colour", "named", "thing"} & {kind for kind, *_ in found}:
            found += self._noun(tokens)
        said = {kind for kind, *_ in found}
        for kind, ranges, (start, end) in found:
            if kind == "named":
                replaced.append((start, end, _basic(ranges, text[start:end])))
            if kind == "thing":
                replaced.append((start, start, _described(ranges, said)))
            if kind == "noun":
                replaced.append((start, start, f"{_basic(ranges, '')} "))
        wanted, contradictions = _merged(found)
        if contradictions:
            told.append(f"contradicts itself in {' and '.join(contradictions)}: what is said first is served")
        if len(denied) > 1:
            told.append("denies several things: the first is avoided")
        avoided = _denied(denied[0]) if denied else row()
        plain = _replaced(text, replaced)
        if not any(letter.isalnum() for letter in plain) and denied:
            plain = "material"
        return Reading(wanted, avoided, plain, len(found) + len(denied), tuple(told))

    def _at(self, words):
        """Return (kind, row, how many words) of the longest name that `words` begin with; (None, None, 0) for none."""
        if HEX.fullmatch(words[0]):
            return "named", colour_row(of_hex(words[0])), 1 + (len(words) > 1 and words[1] in COLOURED)
        for count in range(min(LONGEST, len(words)), 0, -1):
            name = tuple(words[:count])
            if count < len(words) and words[count] in COLOURED and (ranges := self._colour(name)) is not None:
                return "named", ranges, count + 1
            for form in (name, (*name[:-1], name[-1].removesuffix("s")), (*name[:-1], name[-1].removesuffix("es"))):
                if form in self.entries:
                    kind, ranges = self.entries[form]
                    return kind, colour_row(ranges) if kind == "named" else ranges, count
        return None, None, 0

    def _noun(self, tokens):
        """Return the first of the tokens, if any, that XKCD's survey names a colour by, such as a fruit, as the list of
        its (kind, row, span): what is said where no thing is known."""
        for word, span in tokens:
            rgb = every_name().get(word)
            if rgb is not None and word not in UNTOLD:
                return [("noun", colour_row(rgb), span)]
        return []

    def _colour(self, name):
        """Return the row of a name that "-coloured" follows: only of its colour; None for an unknown name."""
        kind, ranges = self.entries.get(name, (None, None))
        if kind in ("colour", "thing"):
            return _only(ranges, COLOUR)
        named = every_name().get(" ".join(name))
        return None if named is None else colour_row(named)


def _words(name):
    return tuple(token for token in TOKEN.findall(name.lower().replace("-", " ")))


def _gloss_row(word):
    if word == "metallic":
        return row(metal=1)
    return row(gloss=gloss_range(*GLOSS_RANGES.get(word, (word,))))


def _only(ranges, axes):
    """Return a row of some axes of a row; the others are left open."""
    kept = torch.full((2, len(AXES)), OPEN)
    kept[:, axes] = ranges.view(2, -1)[:, axes]
    return kept.flatten()


def _merged(found):
    """Return (the row of what a text says, names of that in which it contradicts itself).

    What is said of colour or gloss goes before what is known of things; of several the first counts, unless a later
    one lies within it.
    """
    merged, contradictions = torch.full((2, len(AXES)), OPEN), []
    parts = {
        "colour": [r for kind, r, _ in found if kind in ("colour", "named", "noun")],
        "gloss": [r for kind, r, _ in found if kind == "gloss"],
        "thing": [r for kind, r, _ in found if kind == "thing"],
    }
    for kind, axes in (("colour", COLOUR), ("gloss", GLOSS_AXES)):
        said = [r.view(2, -1)[:, axes] for r in parts[kind]]
        if len(said) > 1 and any(_apart(r, parts[kind][0]) for r in parts[kind][1:]):
            contradictions.append(kind)
        for ranges in (*said, *(r.view(2, -1)[:, axes] for r in parts["thing"])):
            if kind == "colour" and merged[:, axes].isfinite().any():
                break  # of one colour and of another nothing is mixed
            merged[:, axes] = torch.where(merged[:, axes].isnan(), ranges, merged[:, axes])
    if parts["colour"] and merged[0, 4].isnan():  # gold is metal, where nothing else is said
        merged[:, 4] = parts["colour"][0].view(2, -1)[:, 4]
    return merged.flatten(), contradictions


def _apart(one, other):
    """Return whether two rows have nothing in common: the middle of each lies far outside of the other."""
    return min(misfit(_middle(one), other).item(), misfit(_middle(other), one).item()) > 0.5


def _middle(ranges):
    low, high = ranges.view(2, -1)
    middle = (low + high) / 2
    middle[2] = (low[2] + (high[2] - low[2]) % 360 / 2) % 360
    return middle


def _denied(entry):
    kind, ranges = entry
    return {"colour": _only(ranges, COLOUR), "named": _only(ranges, COLOUR)}.get(kind, ranges)


def _described(ranges, said):
    """Return the words for the middle of a thing's row, before its name, that the text has not `said`: an encoder may
    not know the thing, and has read such words in captions."""
    words, middle = [], _middle(ranges)
    if not said & {"gloss"} and middle[3].isfinite():
        words.append(GLOSS[math.floor(middle[3])])
    if not said & {"colour", "named"} and middle[0].isfinite():
        words.append(_basic(ranges, ""))
    return " ".join([*words, ""])


def _basic(ranges, name):
    """Return the plain word for a colour's row: the last one in its name, or that of its middle."""
    if within := [word for word in _words(name) if word in COLOURS or word in SYNONYMS]:
        return within[-1]
    lightness, chroma, hue, *_ = _middle(ranges).nan_to_num(0).tolist()
    seen = {"lightness": [lightness], "chroma": [chroma], "hue": [hue], "metallic": [False]}
    return colour_name(pd.DataFrame(seen))[0]


def _replaced(text, parts):
    for start, end, word in sorted(parts, reverse=True):
        text = f"{text[:start]}{word}{text[end:]}"
    return " ".join(text.split())
