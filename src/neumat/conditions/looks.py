"""What a rendered picture of a material looks like, in words: the truthful colour names of the captions."""

import numpy as np
import torch
from skimage.color import rgb2lab

from neumat.render import scene

# Names of chromatic colours by their CIELAB hue angle (degrees), from where each begins.
HUES = (
    (0, "pink"), (12, "red"), (46, "orange"), (76, "yellow"), (105, "green"), (175, "turquoise"), (240, "blue"),
    (302, "purple"), (356, "pink"),
)  # fmt: skip
GREY, PALE = 6.5, 20.0  # chroma below which a colour is none; below which warm colours are brown or beige
BLACK, DARK, LIGHT, WHITE = 15.0, 25.0, 42.0, 53.0  # lightness; a white Lambert sphere has 60
WORDS = {
    "black": ("black",),
    "gray": ("gray", "grey"),
    "silver": ("silver", "silvery gray"),
    "white": ("white",),
    "brown": ("brown",),
    "beige": ("beige", "light brown"),
    "pink": ("pink", "rose"),
    "red": ("red",),
    "dark red": ("dark red", "maroon", "red"),
    "orange": ("orange",),
    "yellow": ("yellow",),
    "gold": ("gold", "golden"),
    "green": ("green",),
    "turquoise": ("turquoise", "cyan", "teal"),
    "blue": ("blue",),
    "purple": ("purple", "violet"),
}
"""The words for each colour that `colour_names` gives; captions take one of them at random."""


METALS = {"gray": "silver", "white": "silver", "yellow": "gold"}
"""What these colours are called on a metal."""


def colour_names(pictures, metallic):
    """Return a key of WORDS for each uint8 sRGB picture (n, S, S, 3) of a sphere in the scene of `scene.py`.

    metallic (n,), bool: whether it shows a metal, see `METALS`.

    The colour is the median over the sphere of each CIELAB coordinate, which leaves small highlights out, lifted
    half-way towards the mean, which takes in what a metal reflects.
    """
    size = pictures.shape[1]
    axis = ((np.arange(size) + 0.5) / size * 2 - 1) / scene.RADIUS
    disc = torch.from_numpy(np.hypot(axis[:, None], axis) < 0.9)
    lab = rgb2lab(np.asarray(pictures[:, disc]) / 255)
    names = [_name(*row) for row in (np.median(lab, axis=1) + lab.mean(axis=1)) / 2]
    return [METALS.get(name, name) if metal else name for name, metal in zip(names, metallic, strict=True)]


def _name(lightness, a, b):
    chroma, hue = np.hypot(a, b), np.degrees(np.arctan2(b, a)) % 360
    if chroma < GREY:
        return "black" if lightness < BLACK else "gray" if lightness < WHITE else "white"
    name = [word for start, word in HUES if start <= hue][-1]
    if name in ("orange", "yellow", "red") and chroma < PALE and lightness < LIGHT:
        return "yellow" if name == "yellow" and lightness > DARK else "dark red" if hue < 25 else "brown"
    if name in ("orange", "yellow") and chroma < PALE:
        return "beige"
    if name == "red" and lightness > LIGHT:
        return "pink"
    if name == "red" and lightness < DARK:
        return "dark red"
    if name == "pink" and lightness < LIGHT:
        return "dark red" if hue < 180 else "purple"
    if name == "purple" and lightness > LIGHT and hue > 330:
        return "pink"
    return name
