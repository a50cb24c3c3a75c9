"""Words for the numbers of `neumat.metrics.appearance`: the best one, and whether a person would accept a given one.

Hues are CIELAB's, in degrees: sRGB's red lies at 40, its orange (255, 128, 0) at 60, yellow at 103, green at 136, cyan
at 196, blue at 306, magenta at 328. The boundaries between words were set on the rendered spheres of the 100 sources.
"""

import itertools

import numpy as np

from neumat.errors import NeumatError

# Upper ends of the hues of saturated colours; the words differ by lightness and chroma further (see `_word`).
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
    columns = ("lightness", "chroma", "hue", "metallic")
    return [_word(*row) for row in appearance[list(columns)].itertuples(index=False)]


def colour_right(appearance, word):
    """Return whether a person would accept the colour `word` for each row of `appearance`, bool (n,).

    That is, whether a colour within TOLERANCE has that name. Raises NeumatError for a word that is not in COLOURS or
    SYNONYMS.
    """
    word = _known(word, COLOURS, SYNONYMS)
    accepted = {word, *ALSO.get(word, ())}
    right = np.zeros(len(appearance), bool)
    for lightness, chroma, hue in itertools.product((-1, 0, 1), repeat=3):
        near = appearance.assign(
            lightness=appearance["lightness"] + lightness * TOLERANCE["lightness"],
            chroma=appearance["chroma"] * (1 + chroma * TOLERANCE["chroma"]),
            hue=(appearance["hue"] + hue * TOLERANCE["hue"]) % 360,
        )
        right |= np.isin(colour_name(near), list(accepted))
    return right


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


def _word(lightness, chroma, hue, metallic):
    """Return the name of one colour in CIELAB's lightness, chroma and hue (degrees)."""
    if lightness < 10 or (lightness < 20 and chroma < 15):
        return "black"
    if metallic and lightness > 45 and chroma < 8:
        return "silver"
    if lightness > 75 and chroma < 10:
        return "pink" if chroma > 7 and (hue > 330 or hue < 30) else "white"
    if chroma < 8:
        return "gray"
    word = next(word for end, word in HUES if hue <= end)
    if word in ("red", "purple") and (hue > 330 or word == "red") and lightness > 58 and chroma < 60:
        return "pink" if hue < 35 or hue > 330 or chroma > 35 else "beige"
    if word in ("orange", "yellow"):
        if metallic:
            return "gold"
        if lightness > 65 and chroma < 30:
            return "beige"
        if word == "yellow" and lightness <= 60:
            return "brown" if hue < 100 else "green"
        if lightness <= 50 or (chroma < 40 and word == "orange"):
            return "brown"
    if word == "red" and chroma < 35 and 25 < hue < 60:
        return "brown"
    return word
