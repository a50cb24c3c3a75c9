"""What the metrics see of a material: its values at fixed entries of the MERL grid, and its picture."""

import functools
from dataclasses import dataclass

import numpy as np
import torch

from neumat.brdf.coordinates import cosines, grid_angles
from neumat.errors import NeumatError
from neumat.seeds import numpy_generator


@dataclass(frozen=True)
class MaterialSet:
    """n materials: `entries` (E,) flat grid indices, `brdf` (n, E, 3) float32 values there (1/sr, linear RGB),
    `images` (n, H, W, 3) uint8 sRGB, None where no picture is needed.

    Raises NeumatError where the three don't belong together.
    """

    entries: torch.Tensor
    brdf: torch.Tensor
    images: torch.Tensor | None = None

    def __post_init__(self):
        n, e = len(self.brdf), len(self.entries)
        if self.brdf.shape != (n, e, 3):
            raise NeumatError("values of a material set", f"shape (n, {e}, 3)", tuple(self.brdf.shape))
        if self.images is not None and (len(self.images) != n or self.images.dtype != torch.uint8):
            found = f"{len(self.images)} of {self.images.dtype}"
            raise NeumatError("pictures of a material set", f"{n} of torch.uint8", found)

    def __len__(self):
        return len(self.brdf)

    def __getitem__(self, index):
        """Return the materials of a slice or an index tensor as a MaterialSet."""
        return MaterialSet(self.entries, self.brdf[index], None if self.images is None else self.images[index])

    def thinned(self, step):
        """Return the materials at every step-th entry only, without pictures."""
        return MaterialSet(self.entries[::step], self.brdf[:, ::step])

    @functools.cached_property
    def finite(self):
        """Bool (n,): every value of the material is finite."""
        return torch.isfinite(self.brdf).flatten(1).all(1)

    @property
    def cos_light(self):
        """Cosine of the light's angle with the normal at every entry, (E,), not below 0."""
        return cosines(*grid_angles(self.entries))[0].clamp_min(0)


def union(a, b):
    """Return the materials of `a` followed by those of `b`; pictures only where both have them.

    Raises NeumatError where their entries differ.
    """
    if not torch.equal(a.entries, b.entries):
        raise NeumatError("material sets", "the same metric entries", "different ones")
    images = None if a.images is None or b.images is None else torch.cat([a.images, b.images])
    return MaterialSet(a.entries, torch.cat([a.brdf, b.brdf]), images)


def metric_entries(entries, count, seed):
    """Return `count` of the valid flat grid indices `entries` (V,), one at random from each of `count` equal runs of
    the grid's order, sorted, int64: their mean estimates the mean over all valid entries without bias.

    Raises NeumatError where there are fewer entries than asked for.
    """
    entries = np.sort(np.asarray(entries, dtype=np.int64))
    if not 1 <= count <= len(entries):
        raise NeumatError("metric entries", f"a count from 1 to {len(entries)}, the valid entries", count)
    edges = np.linspace(0, len(entries), count + 1).astype(np.int64)
    chosen = numpy_generator(seed, "metric entries").integers(edges[:-1], edges[1:])
    return torch.from_numpy(entries[chosen])
