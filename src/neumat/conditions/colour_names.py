"""Colours by number or name: hexadecimal, and the names of CSS and of XKCD's survey, which come with matplotlib."""

import functools
import re

from neumat.errors import NeumatError
from neumat.metrics.words import COLOURS, GLOSS_SYNONYMS, SYNONYMS

HEX = re.compile(r"#(?:[0-9a-f]{6}|[0-9a-f]{3})(?![0-9a-f])", re.IGNORECASE)
# CSS names that are people or places first, and first words of XKCD's names that tell the gloss.
NO_COLOURS = {"peru"}
GLOSS_FIRST = {"dull", "flat", "soft", "metallic", *GLOSS_SYNONYMS}


def read_colour(text):
    """Return sRGB in 0..1 of "#b87333" or the name of a colour. Raises NeumatError for anything else."""
    told = text.strip().lower() if isinstance(text, str) else ""
    if HEX.fullmatch(told):
        return of_hex(told)
    found = every_name().get(_plain(told))
    if found is None:
        expected = 'a number such as "#b87333" or a name of CSS or XKCD, such as "navy blue"'
        raise NeumatError("colour", expected, repr(text))
    return found


def of_hex(number):
    """Return sRGB in 0..1 of "#b87333" or "#f80"."""
    digits = number[1:] if len(number) == 7 else "".join(2 * digit for digit in number[1:])
    return tuple(int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4))


@functools.cache
def every_name():
    """Return {name, in lower case and without hyphens: sRGB in 0..1}."""
    from matplotlib.colors import CSS4_COLORS, XKCD_COLORS  # takes a tenth of a second: read where it is needed

    found = {_plain(name.removeprefix("xkcd:")): of_hex(number.lower()) for name, number in XKCD_COLORS.items()}
    return found | {name: of_hex(number.lower()) for name, number in CSS4_COLORS.items()}


@functools.cache
def running_names():
    """Return the part of `every_name` that is understood within other words: of names of one word, CSS' only, since
    XKCD's, such as leather or dust, name things as well; and none of the plain words that are ranges, see `ranges`."""
    from matplotlib.colors import CSS4_COLORS

    plain = {*COLOURS, *SYNONYMS, *NO_COLOURS}
    found = {}
    for name, rgb in every_name().items():
        first, *rest = name.split()
        if name not in plain and first not in GLOSS_FIRST and (rest or name in CSS4_COLORS):
            found[name] = rgb
    return found


def _plain(name):
    return " ".join(name.lower().replace("-", " ").replace("/", " ").split())
