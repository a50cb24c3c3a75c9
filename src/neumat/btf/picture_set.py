"""A measured BTF as its files give it: pictures at pairs of directions, read block by block."""

from collections.abc import Callable
from dataclasses import dataclass

import torch

BLOCK = 1 << 23  # texels of the pictures that are held at once


@dataclass
class PictureSet:
    """Pictures of one surface under every light for every view.

    light, view (s, 3): directions of each picture, view by view; side: of the square pictures, texels; read: returns
    the pictures (n, side, side, 3) of a slice, float32, linear RGB, rows along +y; size_mm: of a side, None where the
    files don't tell; scale: what a value is multiplied by to get 1/sr; partial: whether views of the standard are
    missing; source: what was read, a text.
    """

    light: torch.Tensor
    view: torch.Tensor
    side: int
    read: Callable[[slice], torch.Tensor]
    size_mm: float | None
    scale: float
    partial: bool
    source: str

    def blocks(self):
        """Return the slices of pictures to read one after the other."""
        return blocks(len(self.light), self.side)


def blocks(count, side):
    """Return slices of `count` pictures of side x side texels that memory holds one at a time."""
    size = max(1, BLOCK // side**2)
    return [slice(first, min(first + size, count)) for first in range(0, count, size)]
