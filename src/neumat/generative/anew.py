"""Samples that must pass a check: what does not is drawn anew."""

import torch

from neumat.errors import NeumatError
from neumat.fields.mirrored import mended
from neumat.fields.validity import valid
from neumat.seeds import seed_for

ROUNDS = 8


def drawn_anew(draw, passes, n, seed, where, name="again"):
    """Return (weights (n, 675), how many were drawn for them).

    draw: (positions (k,) among the n, seed, share) -> (weights (k, 675), how many were drawn for them). passes: weights
    (k, 675) -> bool (k,). What fails is drawn anew, in up to ROUNDS rounds; each has a seed of its own, by `name`, and
    half the share of the one before, 1 in the first. Raises NeumatError for n below 1, and, of `where`, if all rounds
    are not enough.
    """
    if n < 1:
        raise NeumatError("n", "at least 1 sample", n)
    weights, drawn = draw(torch.arange(n), seed, 1.0)
    for round_ in range(1, ROUNDS):
        broken = (~passes(weights)).nonzero()[:, 0]
        if not len(broken):
            return weights, drawn
        weights[broken], more = draw(broken, seed_for(seed, name, round_), 0.5**round_)
        drawn += more
    if broken := int((~passes(weights)).sum()):
        raise NeumatError(where, "valid BRDFs", f"{broken} broken ({drawn} drawn)")
    return weights, drawn


def served(draw, n, seed, where, passes=valid):
    """Return the same of what is drawn and then mended for programs that do not fold phi_d, see `fields.mirrored`."""

    def mend(rows, seed, share):
        weights, drawn = draw(rows, seed, share)
        return mended(weights), drawn

    return drawn_anew(mend, passes, n, seed, where, "mended")
