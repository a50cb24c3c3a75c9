"""What a request asks of a material's appearance: ranges of colour, gloss and metal, as a row of numbers.

A row holds the lower ends of AXES, then the upper ends; NaN where an axis is left open. Lightness, chroma and hue
(degrees) are CIELAB's, as `neumat.metrics.appearance` measures them, relative to its white; gloss is the position of
the word in `neumat.metrics.words.GLOSS`; metal is 0 or 1. A range of hues may run through 0.
"""

import math
import warnings

import numpy as np
import torch
from skimage.color import lab2rgb, rgb2lab

from neumat.metrics.words import GLOSS, gloss_name
from neumat.render.scene import to_linear

AXES = ("lightness", "chroma", "hue", "gloss", "metal")
SIZE = 2 * len(AXES)
OPEN = math.nan
STEP = 10.0  # CIELAB: a colour so far beyond its range weighs as much as one step of gloss
COLOURED = 40.0  # chroma, above which a hue's error weighs no more
# Tolerances of a colour that is asked for by its number: what is told apart side by side only.
TOLERANCE = {"lightness": 6.0, "chroma": (4.0, 0.12), "hue": 8.0}  # of chroma: a number, and a share of it
MARGIN = 0.15  # of a range, at either end, into which no colour is moved
SPREAD = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703)  # 1 / g, 1 / g^2, 1 / g^3 of g^4 = g + 1
NEUTRAL = 6.0  # chroma, below which a colour has no hue

# Inside of what `neumat.metrics.words` calls these colours.
WORDS = {
    "red": ((22, 55), (45, 120), (10, 46), None),
    "orange": ((54, 75), (48, 120), (54, 70), 0),
    "yellow": ((65, 96), (36, 120), (80, 105), 0),
    "green": ((22, 88), (16, 120), (112, 180), None),
    "turquoise": ((30, 88), (14, 120), (190, 235), None),
    "blue": ((16, 82), (16, 130), (245, 302), None),
    "purple": ((18, 55), (20, 120), (312, 348), None),
    "pink": ((62, 88), (20, 58), (340, 28), None),
    "brown": ((22, 46), (12, 45), (52, 85), None),
    "beige": ((68, 92), (11, 27), (60, 100), 0),
    "white": ((82, 100), (0, 7), None, 0),
    "gray": ((25, 72), (0, 6), None, None),
    "black": ((0, 14), (0, 10), None, None),
    "gold": ((48, 92), (18, 80), (58, 103), 1),
    "silver": ((50, 96), (0, 6), None, 1),
}


def row(lightness=None, chroma=None, hue=None, gloss=None, metal=None):
    """Return the row (SIZE,) of these ranges, pairs of numbers; metal is 0, 1 or None, and None leaves an axis open."""
    pairs = [lightness, chroma, hue, gloss, None if metal is None else (metal, metal)]
    ends = [(OPEN, OPEN) if pair is None else pair for pair in pairs]
    return torch.tensor([end[0] for end in ends] + [end[1] for end in ends], dtype=torch.float32)


def gloss_range(first, last=None):
    """Return the range of gloss from one word of GLOSS to another."""
    return GLOSS.index(first), GLOSS.index(last or first)


def word_row(word):
    """Return the row of a colour word, of `neumat.metrics.words.COLOURS`."""
    lightness, chroma, hue, metal = WORDS[word]
    return row(lightness, chroma, hue, metal=metal)


def colour_row(rgb):
    """Return the row of one colour, sRGB in 0..1, within TOLERANCE."""
    lightness, a, b = rgb2lab(np.asarray(rgb, float)[None, None])[0, 0]
    chroma, hue = math.hypot(a, b), math.degrees(math.atan2(b, a)) % 360
    apart = TOLERANCE["chroma"][0] + TOLERANCE["chroma"][1] * chroma
    around = None if chroma < NEUTRAL else ((hue - TOLERANCE["hue"]) % 360, (hue + TOLERANCE["hue"]) % 360)
    bright = (max(0, lightness - TOLERANCE["lightness"]), lightness + TOLERANCE["lightness"])
    return row(bright, (max(0, chroma - apart), chroma + apart), around)


def seen(appearance):
    """Return the positions (n, 5) on AXES of the rows of `neumat.metrics.appearance.appearance`."""
    gloss = [GLOSS.index(name) for name in gloss_name(appearance)]
    columns = [appearance["lightness"], appearance["chroma"], appearance["hue"], gloss, appearance["metallic"]]
    return torch.tensor(np.stack([np.asarray(column, np.float32) for column in columns], 1))


def misfit(positions, rows):
    """Return how far (...,) positions (..., 5) lie outside of ranges (..., SIZE): 0 within all of them, about 1 for
    each step of gloss, metal that should be none, and each STEP of colour."""
    low, high = rows[..., : len(AXES)], rows[..., len(AXES) :]
    off = torch.maximum(low - positions, positions - high).clamp_min(0)
    before, after = _beyond(positions[..., 2], low[..., 2], high[..., 2])
    arc = torch.deg2rad(torch.minimum(before, after)) * positions[..., 1].clamp_max(COLOURED)
    scaled = torch.stack([off[..., 0] / STEP, off[..., 1] / STEP, arc / STEP, off[..., 3], off[..., 4]], -1)
    return scaled.nan_to_num(0).sum(-1)


def colours_within(positions, rows):
    """Return colours (n, 3), lightness, chroma and hue, within ranges (n, SIZE), of positions (n, 5): axes that lie
    within stay, as open ones do; others move into the range, evenly spread over its middle by the row's number."""
    low, high = rows[:, :3], rows[:, len(AXES) : len(AXES) + 3]
    width = torch.where(torch.tensor([False, False, True]), (high - low) % 360, high - low)
    # The golden ratio's sequence in three dimensions (Roberts 2018): even, and none depends on how many follow.
    spread = (torch.arange(1, len(rows) + 1)[:, None] * torch.tensor(SPREAD, dtype=torch.float64) % 1).float()
    moved = low + (MARGIN + (1 - 2 * MARGIN) * spread) * width
    moved[:, 2] %= 360
    own = positions[:, :3]
    outside = (own < low) | (own > high)
    outside[:, 2] = torch.minimum(*_beyond(own[:, 2], low[:, 2], high[:, 2])) > 0
    return torch.where(outside, moved, own)


def linear_rgb(colours):
    """Return linear sRGB (n, 3), relative to white, of lightness, chroma and hue (n, 3); clipped to what sRGB holds."""
    lightness, chroma, hue = colours.double().numpy().T
    hue = np.radians(hue)
    lab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], 1)
    with warnings.catch_warnings(action="ignore"):  # of colours that sRGB does not hold
        encoded = lab2rgb(lab[None])[0]
    return to_linear(torch.from_numpy(encoded)).float()


def _beyond(hue, low, high):
    """Return how many degrees (...,) a hue lies before the range and how many after it, both 0 within; NaN where the
    range is open."""
    into, width = (hue - low) % 360, (high - low) % 360
    within = into <= width
    return (360 - into).masked_fill(within, 0), (into - width).masked_fill(within, 0)
