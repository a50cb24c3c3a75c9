"""The contract of all synthesis methods: features of an endless plane, at any position that is asked for."""

import torch

from neumat.btf.planes import level_sizes, prefilter
from neumat.errors import NeumatError

CHUNK = 1 << 15  # queries at a time: what they need stays in a core's cache
LARGEST = 2.0**40  # beyond, float64 tells a position to a few texels only, and products of integers may overflow


class Synthesis:
    """An endless plane made from an exemplar `plane` (H, W, c), float32.

    Positions are in units of the exemplar's side; texel (i, j) of the exemplar has its centre at ((j + 1/2) / W,
    (i + 1/2) / H). seed: any integer; which parts of the exemplar appear where depends on it. tileable: whether the
    exemplar's opposite borders match; if not, no method but tiling crosses them. levels: the exemplar's levels of
    detail, `plane` the first, as `Representation.levels` gives them; None: means of features. Which part of it
    appears where is chosen on `plane`, for all levels.

    Choices are hashes of integers, the same everywhere. A query's features depend on nothing but the query, to the bit:
    not on the order or the size of the batch.

    Subclasses set `fetches` (bilinear fetches a query), `dynamic` (whether nothing is made before it is asked for) and
    `stored` (the tensors that they keep), and define `_features`.
    """

    fetches = 1
    dynamic = True

    def __init__(self, plane, seed, tileable=False, levels=None):
        if plane.ndim != 3 or 0 in plane.shape:
            raise NeumatError("synthesis", "a plane of shape (H, W, c)", f"shape {tuple(plane.shape)}")
        self.exemplar = levels or prefilter(plane)
        if not all(level.isfinite().all() for level in self.exemplar):
            raise NeumatError("synthesis", "a plane of finite features", "NaN or infinite ones")
        self.height, self.width, self.channels = plane.shape
        self.seed, self.tileable = seed, tileable
        self.top = len(self.exemplar) - 1  # the level at which the exemplar is one texel
        self.stored = []
        shapes = [tuple(level.shape) for level in self.exemplar]
        expected = [(*size, self.channels) for size in level_sizes(self.height, self.width)]
        if shapes != expected:
            raise NeumatError("synthesis", f"levels of detail of shapes {expected}", shapes)

    @property
    def bytes(self):
        """Bytes of all that the method stores."""
        return sum(tensor.numel() * tensor.element_size() for tensor in self.stored)

    def at(self, u, level=0.0):
        """Return features (n, c), float32, at positions `u` (n, 2), float64.

        level: log2 of the texels under a pixel, one number or a tensor (n,); below 0 counts as 0. Where `u` is not
        finite or beyond 2^40, or `level` NaN, the features are NaN.
        """
        cell = torch.floor(u)
        return self.at_cell(cell.long(), torch.where(u.abs() < LARGEST, u - cell, torch.nan), level)

    @torch.no_grad()
    def at_cell(self, cell, fraction, level=0.0):
        """Return the features at positions `cell` (n, 2), int64, within 2^40, plus `fraction` (n, 2), float64,
        in [0, 1)."""
        level = torch.as_tensor(level, dtype=torch.float32, device=fraction.device).expand(len(fraction))
        fraction = torch.where(level.isnan()[:, None], torch.nan, fraction)
        level = level.nan_to_num().clamp(0, self.top)
        parts = zip(cell.split(CHUNK), fraction.split(CHUNK), level.split(CHUNK), strict=True)
        rows = [self._between_levels(*part) for part in parts]
        return torch.cat(rows) if rows else torch.empty(0, self.channels, device=fraction.device)

    def _between_levels(self, cell, fraction, level):
        """Return features interpolated between the two whole levels next to `level` (n,)."""
        lower = torch.floor(level)
        place = (level - lower)[:, None]
        features = self._at_levels(cell, fraction, lower.long())
        if place.any():
            features = features + place * (self._at_levels(cell, fraction, lower.long() + 1) - features)
        return features

    def _at_levels(self, cell, fraction, levels):
        """Return features at whole `levels` (n,)."""
        present = levels.unique().tolist()
        if len(present) == 1:
            return self._features(cell, fraction, present[0])
        features = torch.empty(len(cell), self.channels, device=fraction.device)
        for level in present:
            rows = levels == level
            features[rows] = self._features(cell[rows], fraction[rows], level)
        return features

    def _features(self, cell, fraction, level):
        """Return features (n, c) at a whole `level`, an integer >= 0."""
        raise NotImplementedError
