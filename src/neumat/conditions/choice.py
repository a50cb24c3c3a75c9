"""Which of many fields answer a request: what is seen of them, how well that fits, which ones are served."""

from dataclasses import dataclass

import torch

from neumat.conditions.diversity import most_different
from neumat.conditions.ranges import misfit

CHOOSY = 4  # one in so many candidates is a good answer, of which different ones are served
COLOUR = [0, 1, 2, 5, 6, 7]  # of a row of ranges: the ends of lightness, chroma and hue
RANGES = {"wanted", "avoided"}  # of a request: what is no modality of the model


@dataclass(frozen=True)
class Seen:
    """What requests are compared with, of candidates (r, m) or, for every request the same, (1, m): their positions
    (.., 5) among `ranges.AXES`, encoded descriptions and embedded pictures, each (.., size); None for pictures that
    nobody looks at."""

    positions: torch.Tensor
    described: torch.Tensor
    embedded: torch.Tensor | None = None

    def view(self, *shape):
        """Return the same with other leading dimensions."""
        parts = self.positions, self.described, self.embedded
        return Seen(*(part if part is None else part.view(*shape, part.shape[-1]) for part in parts))


def fit(seen, asked, embedded, descriptions):
    """Return how well (r, m) candidates answer r requests, the larger the better.

    asked: {modality: rows (r, size), as encoded}, embedded: the same in the common space, see `Synthesiser`. Added up:
    the cosines of pictures, where there are any, with text and image and those of descriptions with the text; less what
    is outside of the ranges that the request wants, and one where all is within those that it denies.

    Pictures are left out where a text stands alone: they take most of the time of a request, and with them the prompts
    for validation are answered in the same colours and gloss, but with two thirds of the diversity.
    """
    score = torch.zeros(seen.positions.shape[:-1])
    if seen.embedded is not None:
        score = sum(cosines(seen.embedded, embedded[name]) for name in ("text", "image") if name in embedded)
    if "text" in asked:
        score = score + cosines(seen.described, descriptions.centred(asked["text"]))
    if "wanted" in asked:
        score = score - misfit(seen.positions, asked["wanted"][:, None])
    if "avoided" in asked:
        denied = asked["avoided"][:, None]
        score = score - ((misfit(seen.positions, denied) == 0) & denied.isfinite().any(2)).float()
    return score


def cosines(found, wanted):
    """Return the cosines (r, m) of rows (r, m, size), or (1, m, size) for all alike, with (r, size), of length 1."""
    return wanted @ found[0].T if len(found) == 1 else torch.einsum("rms,rs->rm", found, wanted)


def choose(weights, score, n):
    """Return n (r, n, 675) of fields (r, m, 675): of those whose score (r, m) is best (see CHOOSY), different ones."""
    rows = torch.arange(len(weights))[:, None]
    best = weights[rows, score.topk(max(n, weights.shape[1] // CHOOSY)).indices]
    return best[rows, most_different(best, n)]


def only_shown(asked):
    """Return whether a picture is all that is given of a request."""
    return asked.keys() - RANGES == {"image"}


def colourless(asked):
    """Return a request without the ranges of colour that it wants."""
    if "wanted" not in asked:
        return asked
    open_ = asked["wanted"].clone()
    open_[:, COLOUR] = float("nan")
    return asked | {"wanted": open_}


def coloured(wanted):
    """Return whether rows of ranges (..., SIZE) want a colour."""
    return wanted[..., COLOUR].isfinite().any(-1)


def off_colour(positions, wanted):
    """Return how far (...,) positions (..., 5) are outside of the colours of ranges (..., SIZE), see `misfit`."""
    colours = torch.full_like(wanted, float("nan"))
    colours[..., COLOUR] = wanted[..., COLOUR]
    return misfit(positions, colours)
