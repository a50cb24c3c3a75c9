"""A measured BTF as its files give it: pictures at pairs of directions, read block by block."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import torch

BLOCK = 1 << 23  # texels of the pictures that are held at once


@dataclass
class PictureSet:
    """Pictures of one surface under every light for every view.

    light, view (s, 3): directions of each picture, view by view; side: of the square pictures, texels; blocks: returns
    an iterator of pictures (n, side, side, 3) float32, linear RGB, in that order, whose rows run along +y; size_mm: of
    a side, None where the files don't tell; scale: what a value is multiplied by to get 1/sr; partial: whether views of
    the standard are missing; source: what was read, a text.
    """

    light: torch.Tensor
    view: torch.Tensor
    side: int
    blocks: Callable[[], Iterator[torch.Tensor]]
    size_mm: float | None
    scale: float
    partial: bool
    source: str


def grid(views, lights):
    """Return light and view (v l, 3) of every light (l, 3) for every view (v, 3), view by view."""
    return lights.repeat(len(views), 1), views.repeat_interleave(len(lights), 0)


def block_size(side):
    """Return how many pictures of side x side texels a block holds."""
    return max(1, BLOCK // side**2)
