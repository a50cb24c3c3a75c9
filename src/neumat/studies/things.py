"""How often answers to the name of a thing lie within the ranges that it has: things that are known, and held out ones.

No caption names a thing that is held out (`conditions.things.held_out`), and here the choice of answers does not know
it either: what is left are colours and things in its name, and what the encoder makes of it.
"""

import copy

import numpy as np
import pandas as pd
import torch

from neumat.conditions.ranges import AXES, misfit, seen
from neumat.conditions.things import held_out, known_things
from neumat.conditions.wanted import Vocabulary
from neumat.metrics.alignment import diversity
from neumat.metrics.appearance import appearance
from neumat.studies.request_bench import LOOK_UP, RECOLOURED
from neumat.studies.requests import interval

HELD, KNOWN = "held out", "known"
AXES_OF = {"all": range(len(AXES)), "colour": (0, 1, 2), "gloss": (3, 4)}
COLUMNS = ["things", "method", "measure", "value", "low", "high", "count"]


def things_table(bench, things, n, guidance, candidates, seed, progress=iter):
    """Return a DataFrame with COLUMNS: the share of n answers to each thing that lie within its ranges, the mean over
    the things with its 95 % interval, and the diversity of the answers.

    bench: a `request_bench.Bench`; things: {names: row}, see `things.read_things`. Of held-out things everything is
    asked of a Synthesiser that does not know them. Methods: "served"; the look-ups, see `Bench.looked_up`; "nearest
    known thing", whose ranges are served in place of the thing's, by the encoded names; "no request": random samples.
    """
    held, rows = set(held_out(things)), []
    for label, unseen in ((HELD, True), (KNOWN, False)):
        names = [own for own in things if (own in held) == unseen]
        synthesiser = knowing(bench.synthesiser, known_things(things, unseen))
        asked = synthesiser.read_texts([own[0] for own in names], force=True)
        weights, _ = synthesiser.answers(asked, n, seed, guidance, candidates)
        answers = {"served": weights, LOOK_UP: bench.look_up.answers(asked, n, candidates)}
        answers[RECOLOURED] = bench.plain_look_up.recoloured(asked, n, candidates)
        if unseen:
            near = nearest(synthesiser, names, known_things(things, unseen))
            replaced = asked | {"wanted": torch.stack([things[own] for own in near])}
            answers["nearest known thing"] = bench.plain_look_up.recoloured(replaced, n, candidates)
        weights, _ = synthesiser.model.sample(n * len(names), seed, {})
        answers["no request"] = weights.view(len(names), n, -1)
        wanted = torch.stack([things[own] for own in names])
        for method, fields in progress(answers.items()):
            rows += [(label, method, *row) for row in _judged(bench, fields, wanted)]
    return pd.DataFrame(rows, columns=COLUMNS)


def knowing(synthesiser, things):
    """Return the same Synthesiser as one that knows these things alone, {names: row}."""
    other = copy.copy(synthesiser)
    other.vocabulary = Vocabulary(things)
    return other


def nearest(synthesiser, names, known):
    """Return the names of the known things whose encoded first name is nearest to that of each of `names`."""
    encode = synthesiser.encoder.encode_text
    cosine = encode([own[0] for own in names]) @ encode([own[0] for own in known]).T
    return [[*known][k] for k in cosine.argmax(1).tolist()]


def _judged(bench, fields, wanted):
    """Yield (measure, value, low, high, things) of fields (t, n, 675) against ranges (t, SIZE)."""
    positions = seen(appearance(fields.flatten(0, 1))).view(*fields.shape[:2], -1)
    for name, axes in AXES_OF.items():
        only = torch.full_like(wanted, float("nan")).view(-1, 2, len(AXES))
        only[:, :, list(axes)] = wanted.view(-1, 2, len(AXES))[:, :, list(axes)]
        within = (misfit(positions, only.flatten(1)[:, None]) == 0).float().mean(1)
        yield f"within its ranges, {name}", *interval(within), len(within)
    spread = [diversity(bench.materials(few)) for few in fields]
    yield "diversity", np.mean(spread), np.nan, np.nan, len(spread)
