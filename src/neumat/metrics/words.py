"""Words for the numbers of `neumat.metrics.appearance`: the best one, and whether a person would accept a given one.

Hues are CIELAB's, in degrees: sRGB's red lies at 40, its orange (255, 128, 0) at 60, yellow at 103, green at 136, cyan
at 196, blue at 306, magenta at 328. The boundaries between words were set on the rendered spheres of the 100 sources.
"""

import itertools

import numpy as np

from neumat.errors import NeumatError

# Upper ends of the hues of saturated colours; the words differ by lightness and chroma further (see `_colour`).
HUES = ((50, "red"), (73, "orange"), (108, "yellow"), (185, "green"), (240, "turquoise"), (307, "blue"))
HUES += ((355, "purple"), (360, "red"))
COLOURS = ("red", "orange", "yellow", "green", "turquoise", "blue", "purple", "pink", "brown", "beige")
COLOURS += ("white", "gray", "black", "gold", "silver")
SYNONYMS = {"cyan": "turquoise", "violet": "purple", "grey": "gray"}
ALSO = {"gray": ("silver",)}  # what a person says of a word's neighbour without being wrong
TOLERANCE = {"lightness": 4, "chroma": 0.15, "hue": 8}  # CIELAB; of chroma a share; degrees

# Contrasts, see `neumat.metrics.appearance`. Sharp is what at least SHARP_SHARE of the contrast comes from.
GLOSS = ("matte", "satin", "glossy", "mirror")
SATIN_CONTRAST, GLOSSY_CONTRAST, MIRROR_CONTRAST = 0.04, 0.006, 0.25  # the last two of the sharp core
SHARP_SHARE, MIRROR_SHARE = 0.15, 0.7
GLOSS_TOLERANCE = 1.25  # a factor
GLOSS_SYNONYMS = {"shiny": "glossy", "mirror-like": "mirror", "specular": "glossy", "diffuse": "matte", "dull": "matte"}
GLOSS_SYNONYMS |= {"sheen": "satin", "metal": "metallic"}
GLOSS_ALSO = {"glossy": ("mirror",)}


def colour_name(appearance):
    """Return the best of COLOURS for each row of `appearance`, a list of str."""
    return _colour(*_seen(appearance)).tolist()


def colour_right(appearance, word):
    """Return whether a person would accept the colour `word` for each row of `appearance`, bool (n,).

    That is, whether a colour within TOLERANCE has that name. Raises NeumatError for a word that is not in COLOURS or
    SYNONYMS.
    """
    word = _known(word, COLOURS, SYNONYMS)
    lightness, chroma, hue, metallic = _seen(appearance)
    near = np.array([*itertools.product((-1, 0, 1), repeat=3)])[:, :, None]
    lightness = lightness + near[:, 0] * TOLERANCE["lightness"]
    chroma = chroma * (1 + near[:, 1] * TOLERANCE["chroma"])
    hue = (hue + near[:, 2] * TOLERANCE["hue"]) % 360
    return np.isin(_colour(lightness, chroma, hue, metallic), [word, *ALSO.get(word, ())]).any(0)


def gloss_name(appearance):
    """Return the best of GLOSS for each row of `appearance`, a list of str.

    Matte: no highlight to be seen. Satin: a soft one. Glossy: one that shows the shape of the lamp. Mirror: one that
    is all that is seen.
    """
    return list(_gloss(appearance["contrast"].to_numpy(), appearance["sharp_contrast"].to_numpy()))


def gloss_right(appearance, word):
    """Return whether a person would accept the gloss `word` for each row of `appearance`, bool (n,).

    That is, whether a highlight of a contrast within a factor of GLOSS_TOLERANCE has that name. "metallic" is a word
    too, as `appearance` defines it. Raises NeumatError for any other word not in GLOSS or GLOSS_SYNONYMS.
    """
    word = _known(word, (*GLOSS, "metallic"), GLOSS_SYNONYMS)
    if word == "metallic":
        return appearance["metallic"].to_numpy(bool)
    contrast, sharp = appearance["contrast"].to_numpy(), appearance["sharp_contrast"].to_numpy()
    factors = (1 / GLOSS_TOLERANCE, 1, GLOSS_TOLERANCE)
    names = [_gloss(contrast * a, sharp * b) for a, b in itertools.product(factors, factors)]
    return np.isin(names, [word, *GLOSS_ALSO.get(word, ())]).any(0)


def prompt_met(appearance, expected):
    """Return whether all is true (n,) of `appearance` that is `expected`: {"colour": word, "gloss": word}, or empty."""
    met = np.ones(len(appearance), bool)
    for column, right in (("colour", colour_right), ("gloss", gloss_right)):
        if expected[column]:
            met &= right(appearance, expected[column])
    return met


def says(text, word):
    """Return whether a text holds `word`, of COLOURS, GLOSS or "metallic", or a synonym of it."""
    synonyms = [other for other, meant in (SYNONYMS | GLOSS_SYNONYMS).items() if meant == word]
    return not {word, *synonyms}.isdisjoint(text.lower().replace(",", " ").split())


def _known(word, words, synonyms):
    found = synonyms.get(word, word)
    if found not in words:
        raise NeumatError("word", f"one of {', '.join([*words, *synonyms])}", repr(word))
    return found


def _gloss(contrast, sharp):
    share = sharp / np.maximum(contrast, 1e-6)
    cases = [
        (sharp >= MIRROR_CONTRAST) & (share >= MIRROR_SHARE),
        (sharp >= GLOSSY_CONTRAST) & (share >= SHARP_SHARE),
        contrast >= SATIN_CONTRAST,
    ]
    return np.select(cases, GLOSS[:0:-1], GLOSS[0])


def _seen(appearance):
    return (appearance[name].to_numpy() for name in ("lightness", "chroma", "hue", "metallic"))


def _colour(lightness, chroma, hue, metallic):
    """Return the names of colours in CIELAB's lightness, chroma and hue (degrees), arrays that broadcast."""
    ends, words = zip(*HUES, strict=True)
    word = np.array(words)[np.searchsorted(ends, hue)]
    red, yellow, warm = word == "red", word == "yellow", np.isin(word, ("orange", "yellow"))
    rosy = (red | (word == "purple") & (hue > 330)) & (lightness > 58) & (chroma < 60)
    light = (lightness > 75) & (chroma < 10)
    cases = [  # the first that holds names the colour
        ("black", (lightness < 10) | (lightness < 20) & (chroma < 15)),
        ("silver", metallic & (lightness > 45) & (chroma < 8)),
        ("pink", light & (chroma > 7) & ((hue > 330) | (hue < 30))),
        ("white", light),
        ("gray", chroma < 8),
        ("pink", rosy & ((hue < 35) | (hue > 330) | (chroma > 35))),
        ("beige", rosy),
        ("gold", warm & metallic),
        ("beige", warm & (lightness > 65) & (chroma < 30)),
        ("brown", yellow & (lightness <= 60) & (hue < 100)),
        ("green", yellow & (lightness <= 60)),
        ("brown", warm & ((lightness <= 50) | (word == "orange") & (chroma < 40))),
        ("brown", red & (chroma < 35) & (hue > 25) & (hue < 60)),
    ]
    names, holds = zip(*cases, strict=True)
    return np.select(holds, names, word)
