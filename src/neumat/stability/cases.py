"""Cases that drive a method to where it breaks, each with a stated bar: what is expected, what happens, what guards."""

from collections.abc import Callable
from dataclasses import dataclass
from textwrap import shorten

import pandas as pd

from neumat.stability.stress import LONGEST, REFUSED, UNNEEDED, WARNED, Answer, attempt

COLUMNS = ["case", "expectation", "result", "guard", "passed"]


@dataclass(frozen=True)
class Case:
    """name; expectation, with its bar, in words; guard: what in the code protects users; run() -> (result in words,
    whether it meets the bar); caught: REFUSED where a NeumatError must end it, WARNED where a warning must be heard;
    part: what its message must say."""

    name: str
    expectation: str
    guard: str
    run: Callable
    part: str = ""
    caught: str = UNNEEDED


def refused(name, part, guard, run):
    """Return the Case that must end in a NeumatError whose one line says `part`."""
    return Case(name, f"refused in one line: {part}", guard, run, part, REFUSED)


def warned(name, expectation, part, guard, run):
    """Return the Case in which a warning must say `part`."""
    return Case(name, f"{expectation}, of which a warning tells", guard, run, part, WARNED)


def case_table(cases, folder, progress=iter):
    """Return a DataFrame with a row for each Case, of COLUMNS.

    Any exception but a NeumatError that is expected makes a row that is not passed. The path of `folder`, in which the
    cases keep their files, is left out of results.
    """
    return pd.DataFrame([tried(case, folder) for case in progress([*cases])], columns=COLUMNS)


def tried(case, folder):
    """Return the row of a Case."""
    answer = attempt(lambda: Answer(*case.run()))
    may = {UNNEEDED: (UNNEEDED, WARNED)}.get(case.caught, (case.caught,))
    passed = answer.right and answer.guard in may and case.part in answer.found
    result = shorten(answer.found.replace(f"{folder}/", ""), LONGEST)
    return case.name, case.expectation, result, case.guard, bool(passed)
