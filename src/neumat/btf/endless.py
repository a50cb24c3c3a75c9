"""An endless BTF: a representation whose positional plane is synthesised at every query."""

import math
from dataclasses import dataclass

import torch

from neumat.btf.representations.base import Representation
from neumat.btf.synthesis import SYNTHESES
from neumat.btf.synthesis.base import Synthesis

CHUNK = 1 << 18  # positions evaluated at a time


def pixel_centres(origin, extent, pixels):
    """Return the positions (pixels^2, 2), float64, of the pixels of a square picture, row by row.

    origin: its first corner (2,); extent: its side, in exemplars.
    """
    along = (torch.arange(pixels, dtype=torch.float64) + 0.5) * (extent / pixels)
    y, x = torch.meshgrid(along + origin[1], along + origin[0], indexing="ij")
    return torch.stack([x, y], -1).flatten(0, 1)


def endless(model, method, seed, tileable):
    """Return the EndlessBtf of a fitted Representation, its plane and levels made endless by `method` of SYNTHESES."""
    levels = model.levels()
    return EndlessBtf(model, SYNTHESES[method](levels[0], seed, tileable, levels))


@dataclass(frozen=True)
class EndlessBtf:
    """representation: fitted; synthesis: of its positional plane."""

    representation: Representation
    synthesis: Synthesis

    def eval(self, u, light, view, level=0.0):
        """Return the values (n, 3), 1/sr, at positions u (n, 2), float64, for unit vectors (n or 1, 3).

        level: level of detail, the binary logarithm of the width of a query's footprint in texels.
        """
        return self.representation.eval(self.synthesis.at(u, level), light, view)

    @torch.no_grad()
    def picture(self, light, view, origin=(0.0, 0.0), extent=1.0, pixels=None):
        """Return the picture (pixels, pixels, 3), 1/sr, of a square for one pair of unit vectors (3,).

        pixels: along a side, by default one a texel. Pixels larger than texels get the level of detail of their size.
        """
        texels = extent * self.representation.size[0]
        pixels = pixels or round(texels)
        level = max(0.0, math.log2(texels / pixels))
        parts = [
            self.eval(part, light[None], view[None], level)
            for part in pixel_centres(origin, extent, pixels).split(CHUNK)
        ]
        return torch.cat(parts).view(pixels, pixels, 3)
