"""Tiling by patches that keep an exemplar's autocovariance, for near-regular structure (after Lutz et al. 2023)."""

import torch

from neumat.btf.hashing import hashed_integers
from neumat.btf.planes import blend
from neumat.btf.synthesis.base import Synthesis
from neumat.btf.synthesis.gaussian import GaussianPlane
from neumat.btf.synthesis.lattice import Cells, autocovariance, cell_sides, whole_and_rest
from neumat.btf.synthesis.triangles import usage
from neumat.seeds import torch_generator

DRAWS = 1024  # positions that patches are drawn from, at most
SHARPNESS = 32  # the power of the autocorrelation by which positions are drawn


class Autocovariance(Synthesis):
    """Two tilings by parallelograms, shifted by half a cell and blended as Gaussian variables.

    The cells' sides are lags at which the exemplar is most like itself, so that all cells lie alike on its lattice. A
    cell shows the exemplar from a position that is drawn with the probability autocorrelation^k of the lag from where
    the cell would continue its neighbours. Its weight falls to 0 at its border, where the other tiling has its middle.
    """

    fetches = 2

    def __init__(self, plane, seed, tileable=False, levels=None):
        super().__init__(plane, seed, tileable, levels)
        correlation = autocovariance(plane, tileable)
        most = [max(1, int(0.6 * n) - 2) for n in (self.width, self.height)]
        self.cells = Cells(cell_sides(correlation, most[0] * most[1] / 6, most)[0])
        half = [x.item() for x in self.cells.point(torch.tensor(1), torch.tensor(1))]
        self.draws = torch.stack([self._draws(correlation, shift) for shift in (half, (0, 0))])
        self.gaussian = GaussianPlane(self.exemplar, self._usage(plane.device), tileable)
        self.stored = [*self.gaussian.stored, self.draws]
        self.likeness = self._likeness(plane.device)

    def _features(self, cell, fraction, level):
        positions, weights = self._patches(cell, fraction)
        a, b = weights[:, :1], weights[:, 1:]
        scale = 1 / (a * a + b * b + 2 * a * b * self.likeness).sqrt()
        return self.gaussian.blend(min(level, self.top), positions, weights, scale)

    def _patches(self, cell, fraction):
        """Return positions in the exemplar (n, 2, 2), float64, and weights (n, 2), float32, of sum 1."""
        x, rest_x = whole_and_rest(cell[:, 0], fraction[:, 0], self.width)
        y, rest_y = whole_and_rest(cell[:, 1], fraction[:, 1], self.height)
        i, j, f, g = self.cells.split(x, y, rest_x, rest_y)
        # In halves of cells: the middles of the first tiling's cells are odd, those of the second's even.
        middles = (2 * i + 1, 2 * j + 1), (2 * (i + (f >= 0.5).long()), 2 * (j + (g >= 0.5).long()))
        size = torch.tensor([self.width, self.height], device=cell.device)
        positions = []
        for draws, (m, n) in zip(self.draws, middles, strict=True):
            drawn = draws[hashed_integers(torch.stack([m, n], -1), self.seed) * draws.shape[0] >> 32]
            middle_x, middle_y = self.cells.point(m, n)
            local = torch.stack([x - middle_x + rest_x, y - middle_y + rest_y], -1)
            positions.append((drawn + local) / size)
        return torch.stack(positions, 1), _weights(f, g)

    def _draws(self, correlation, shift):
        """Return positions in texels (k, 2) for cells' middles, as often as they shall be drawn."""
        bounds = []
        for size, box, far in zip((self.width, self.height), self.cells.box, shift, strict=True):
            reach = 0 if self.tileable else box // 2 + 3
            places = torch.arange(reach, size - reach) if size > 2 * reach else torch.tensor([size // 2])
            lag = places - size // 2 - far
            if self.tileable:
                lag = (lag + size // 2).remainder(size) - size // 2
            bounds.append((places, lag.clamp(1 - size, size - 1)))
        (x, lag_x), (y, lag_y) = bounds
        like = correlation.cpu()[(lag_y + self.height - 1)][:, lag_x + self.width - 1].clamp_min(0)
        other = torch.maximum(lag_x.abs() / self.width, (lag_y.abs() / self.height)[:, None]) > 0.15
        most = like[other].max() if other.any() else like.max()
        share = (like / most.clamp_min(1e-6)).clamp_max(1).pow(SHARPNESS).flatten() + 1e-12
        count = min(DRAWS, self.height * self.width)
        at = (torch.arange(count, dtype=torch.float64) + 0.5) / count * share.sum()
        chosen = torch.searchsorted(share.cumsum(0), at).clamp_max(len(share) - 1)
        return torch.stack([x[chosen % len(x)], y[chosen // len(x)]], -1).int().to(correlation.device)

    def _usage(self, device):
        """Return how often each texel (H, W) of the exemplar appears."""
        places = torch.zeros(self.height, self.width, dtype=torch.float64, device=device)
        if self.tileable:
            return places + 1
        x, y = self.draws.flatten(0, 1).long().unbind(1)
        places.index_put_((y, x), torch.ones(len(x), dtype=torch.float64, device=device), accumulate=True)
        x = torch.arange(1 - self.width, self.width, device=device).expand(2 * self.height - 1, -1)
        y = torch.arange(1 - self.height, self.height, device=device)[:, None].expand_as(x)
        i, j, f, g = self.cells.split(x, y, *self.cells.middle)
        weight = _weights(f, g)[..., 0].double().square()
        return usage(places, torch.where((i == 0) & (j == 0), weight, 0))

    def _likeness(self, device):
        """Return the correlations (c,) of the Gaussian variables of the two patches over a position."""
        generator = torch_generator(0, "likeness")
        cell = torch.randint(-(2**20), 2**20, (20_000, 2), generator=generator).to(device)
        fraction = torch.rand(20_000, 2, dtype=torch.float64, generator=generator).to(device)
        positions, _ = self._patches(cell, fraction)
        weight = torch.ones(20_000, 1, device=device)
        first, second = (blend(self.gaussian.levels[0], positions[:, k : k + 1], weight, self.tileable) for k in (0, 1))
        variance = first.square().mean(0) * second.square().mean(0)
        return ((first * second).mean(0) / variance.sqrt().clamp_min(1e-12)).clamp(0, 1)


def _weights(f, g):
    """Return the weights (..., 2), float32, of the two tilings at a place (f, g) in the first one's cell: the fourth
    powers of the distances from the borders of their cells."""
    f, g = (f - 0.5).abs(), (g - 0.5).abs()  # from the middle
    first, second = 0.5 - torch.maximum(f, g), torch.minimum(f, g)
    share = (first / (first + second + 1e-12)).float()
    share, other = share * share, (1 - share) * (1 - share)  # no powers, whose rounding depends on the batch
    share, other = share * share, other * other
    share = share / (share + other)
    return torch.stack([share, 1 - share], -1)
