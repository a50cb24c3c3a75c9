"""Programs driven to where they break: what must happen, what does, and which guard caught it."""

import contextlib
import logging
from collections.abc import Callable
from dataclasses import dataclass
from textwrap import shorten
from typing import NamedTuple

import pandas as pd

from neumat.errors import NeumatError

COLUMNS = ["stress", "expected", "found", "guard", "ok"]
REFUSED, WARNED, ANEW, UNNEEDED, NONE = "refused", "warned", "drawn anew", "none needed", "none"
LONGEST = 700  # letters of what was found


class Answer(NamedTuple):
    """found: what happened, in words; right: whether that may be trusted; guard: what caught it."""

    found: str
    right: bool
    guard: str = UNNEEDED


@dataclass(frozen=True)
class Stress:
    """name; expected, in words; guards: those of which one must catch it; run() -> Answer, or a NeumatError; part: what
    the message of a refusal or warning must say; protection: what in the code guards users, in words, which tables then
    show in place of what caught it."""

    name: str
    expected: str
    guards: tuple
    run: Callable
    part: str = ""
    protection: str = ""


def refused(name, part, run):
    """Return the Stress that must end in one line which says `part`."""
    return Stress(name, f"one line: {part}", (REFUSED,), run, part)


def stress_table(stresses, folder, progress=iter):
    """Return a DataFrame with a row for each Stress.

    stress; expected and found, in words; guard, what caught it: "refused" or "warned" in one line, "none needed", or
    "none", where there was need; or what protects users, where a Stress says so; ok, whether what was expected
    happened. The path of `folder`, in which the stresses keep their files, is left out.
    """
    return pd.DataFrame([stressed(stress, folder) for stress in progress([*stresses])], columns=COLUMNS)


def stressed(stress, folder):
    """Return the row of a Stress, without the path of the folder that its files are in."""
    found, right, guard = attempt(stress.run)
    ok = bool(right and guard in stress.guards and stress.part in found)
    if not ok and guard not in (REFUSED, WARNED):
        guard = NONE
    found = shorten(found.replace(f"{folder}/", ""), LONGEST)
    return stress.name, stress.expected, found, stress.protection or guard, ok


def attempt(run):
    """Return the Answer of run(); a NeumatError as one "refused", right where its message is one line; any other
    exception, which no guard caught, as one that is not right."""
    with _heard() as said:
        try:
            answer = run()
            if said:
                answer = Answer("; ".join([*said, answer.found]), answer.right, WARNED)
        except NeumatError as error:
            answer = Answer(str(error), "\n" not in str(error), REFUSED)
        except Exception as error:
            answer = Answer(f"{type(error).__name__}: {error}", False, NONE)
    return answer


@contextlib.contextmanager
def _heard():
    """Yield the list of what neumat warns of meanwhile."""
    said, handler = [], logging.Handler(logging.WARNING)
    handler.addFilter(lambda record: record.name == "root")
    handler.emit = lambda record: said.append(record.getMessage())
    logging.getLogger().addHandler(handler)
    try:
        yield said
    finally:
        logging.getLogger().removeHandler(handler)
