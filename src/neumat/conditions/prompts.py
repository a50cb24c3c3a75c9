"""The unseen prompts: requests in words that no training text holds, with what can be measured of each.

Settings are chosen on the prompts for `validation` only; tables report the others. No setting was chosen on prompts for
`report`. Those called `earlier` are reported too, and are an upper bound: guidance, candidates, the power of the
projection, the tuning and the thresholds of `conditions.synthesis` were chosen on them.
"""

from pathlib import Path

from neumat.errors import NeumatError
from neumat.metrics.words import COLOURS, GLOSS, GLOSS_SYNONYMS, SYNONYMS
from neumat.tables import read_texts

COLUMNS = ("prompt", "colour", "gloss", "family", "use")
VALIDATION, EARLIER, REPORT = USES = ("validation", "earlier", "report")
WORDS = {"colour": (*COLOURS, *SYNONYMS), "gloss": (*GLOSS, *GLOSS_SYNONYMS, "metallic")}


def read_prompts(path, families):
    """Return the prompts of a TSV file: a DataFrame of str with COLUMNS, empty where nothing is expected.

    families: the names that are allowed. Raises NeumatError for a missing or foreign file, an empty prompt or one
    given twice (in any case of its letters), a use that is not one of USES or of which there is no prompt, and an
    expectation that is no word of `neumat.metrics.words` or no family.
    """
    path, known = Path(path), WORDS | {"family": tuple(families)}
    table = read_texts(path, "a table of prompts", COLUMNS)
    for line, row in enumerate(table.to_dict("records"), start=2):
        if not row["prompt"].strip():
            raise NeumatError(f"{path}, line {line}", "a prompt", "none")
        for column, words in known.items():
            if row[column] and row[column] not in words:
                raise NeumatError(f"{path}, line {line}", f"as {column} one of {', '.join(words)}", repr(row[column]))
        if row["use"] not in USES:
            raise NeumatError(f"{path}, line {line}", f"as use one of {', '.join(USES)}", repr(row["use"]))
    twice = table["prompt"][table["prompt"].str.strip().str.lower().duplicated()]
    if len(twice) or not len(table):
        raise NeumatError(path, "different prompts, at least one", repr(twice.iloc[0]) if len(twice) else "none")
    if missing := {VALIDATION, REPORT} - set(table["use"]):
        raise NeumatError(path, "prompts for validation and for report", f"none for {' and '.join(sorted(missing))}")
    return table
