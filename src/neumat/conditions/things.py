"""Things with a known appearance: config/things.tsv, ranges of colour and gloss from general knowledge."""

import zlib
from pathlib import Path

import torch

from neumat.conditions.ranges import gloss_range, misfit, row, seen
from neumat.errors import NeumatError
from neumat.metrics.words import GLOSS
from neumat.tables import read_texts

COLUMNS = ("thing", "also", "hue", "lightness", "chroma", "gloss", "metal")
LIMITS = {"hue": 360, "lightness": 100, "chroma": 200}
SHARE = 3  # one thing in so many is held out from the model that is reported


def read_things(path):
    """Return {names (a tuple of str): row, see `conditions.ranges`} of a TSV file with COLUMNS.

    hue, lightness, chroma: two numbers joined by a hyphen, or nothing; gloss: a word of GLOSS or two, joined so; metal:
    yes, no or nothing. also: other names, separated by commas. Raises NeumatError for another file or value, and for a
    name given twice.
    """
    path = Path(path)
    table = read_texts(path, "a table of things", COLUMNS)
    found, names = {}, set()
    for line, given in enumerate(table.to_dict("records"), start=2):
        own = tuple(name.strip().lower() for name in (given["thing"], *given["also"].split(",")) if name.strip())
        if not own or names & set(own):
            raise NeumatError(f"{path}, line {line}", "names that no other thing has", repr(given["thing"]))
        names |= set(own)
        found[own] = _row(f"{path}, line {line}", given)
    return found


def held_out(things):
    """Return the names of the things that a model for reporting does not know: one in SHARE, by the name's digest."""
    return [names for names in things if zlib.crc32(names[0].encode()) % SHARE == 0]


def known_things(things, unseen):
    """Return the things that a model knows: all, or, where some are to be `unseen`, those not held out."""
    left = set(held_out(things)) if unseen else set()
    return {names: ranges for names, ranges in things.items() if names not in left}


def likenesses(appearance, things):
    """Return the first names of the things within whose ranges each row of an appearance lies, a list of tuples."""
    positions, names = seen(appearance), [own[0] for own in things]
    within = misfit(positions[:, None], torch.stack([*things.values()])) == 0
    return [tuple(names[k] for k in row.nonzero()[:, 0].tolist()) for row in within]


def packed(things):
    """Return the things as lists that JSON can hold; `unpacked` returns them."""
    return [[list(names), [None if x != x else x for x in ranges.tolist()]] for names, ranges in things.items()]


def unpacked(lists):
    """Return the things that `packed` made lists of."""
    return {tuple(names): torch.tensor([float("nan") if x is None else x for x in ranges]) for names, ranges in lists}


def _row(where, given):
    ranges = {}
    for column, largest in LIMITS.items():
        ends = given[column].split("-") if given[column] else []
        if ends and not (len(ends) == 2 and all(end.isdecimal() and int(end) <= largest for end in ends)):
            raise NeumatError(where, f"as {column} two numbers up to {largest}, such as 20-40", repr(given[column]))
        ranges[column] = tuple(map(float, ends)) or None
    words = given["gloss"].split("-")
    if len(words) > 2 or not set(words) <= set(GLOSS):
        raise NeumatError(where, f"as gloss one or two of {', '.join(GLOSS)}", repr(given["gloss"]))
    if given["metal"] not in ("yes", "no", ""):
        raise NeumatError(where, "as metal yes, no or nothing", repr(given["metal"]))
    metal = {"yes": 1, "no": 0, "": None}[given["metal"]]
    return row(**ranges, gloss=gloss_range(words[0], words[-1]), metal=metal)
