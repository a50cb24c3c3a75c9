"""How near a synthesised texture is to the truth: statistics of pictures, beside those of the truth's own crops.

A picture is a float32 tensor (H, W, 3) as it is shown (sRGB values, about 0 to 1); all pictures of one comparison have
the same size and scale. A `Statistic` describes one picture and measures the distance from one description to another;
`Truth.compare` puts the distance of a picture from crops of the truth beside the crops' distances from each other.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import torch

from neumat.errors import NeumatError
from neumat.metrics import frechet
from neumat.seeds import torch_generator

PATCH = 8  # side of the patches that are compared, pixels
ALIKE = 0.9  # correlation from which on two windows count as copies
WINDOWS = 48  # that are looked for in the same picture


class Ratio(NamedTuple):
    """A statistic of a picture against the truth, the same of the truth's crops against each other, and the standard
    deviation of the latter over crops."""

    value: float
    truth: float
    scatter: float

    @property
    def ratio(self):
        """1 is perfect; infinite where the truth's own value is 0."""
        return self.value / self.truth if self.truth > 0 else math.inf if self.value > 0 else 1.0


class Statistic(NamedTuple):
    """What is seen of a picture, and how far two such descriptions are apart."""

    describe: Callable  # (picture, exemplar) -> descriptions, stacked in the first dimension
    distance: Callable  # (one description, descriptions (n, ...)) -> (n,)


def describe(picture, exemplar, names=None):
    """Return {statistic: what it sees of a `picture` (H, W, 3)}, for `Truth.ratios`; names: which (None: all).

    exemplar: pixels along the side of the exemplar.
    """
    names = STATISTICS if names is None else names
    return {name: STATISTICS[name].describe(picture, exemplar) for name in names}


class Truth:
    """Crops of the truth (at least 2, as large as the pictures to compare), described once for all comparisons.

    exemplar: pixels along the side of the exemplar; crops must be at least twice as large. names: which of STATISTICS
    (None: all). Raises NeumatError for crops of several or other sizes and for fewer than two.

    Histograms, spectra and autocovariances are taken in windows of the exemplar's size, since no method by example can
    know the process better than one such window shows it; their distances are means over pairs of windows.
    """

    def __init__(self, crops, exemplar, names=None):
        sizes = {tuple(crop.shape) for crop in crops}
        if len(crops) < 2 or len(sizes) > 1 or min(crops[0].shape[:2]) < 2 * exemplar or crops[0].shape[2:] != (3,):
            expected = f"at least 2 crops of one size, {2 * exemplar} pixels a side"
            raise NeumatError("comparison of textures", expected, f"{len(crops)} crops, sizes {sorted(sizes)}")
        self.size, self.count, self.exemplar = crops[0].shape, len(crops), exemplar
        self.statistics = STATISTICS if names is None else {name: STATISTICS[name] for name in names}
        self.described, self.among = {}, {}
        for name, statistic in self.statistics.items():
            theirs = [statistic.describe(crop, exemplar) for crop in crops]
            others = (torch.cat([b for b in theirs if b is not crop]) for crop in theirs)
            among = [_distance(statistic, crop, other) for crop, other in zip(theirs, others, strict=True)]
            self.described[name], self.among[name] = torch.cat(theirs), torch.tensor(among, dtype=torch.float64)

    def compare(self, picture, names=None):
        """Return {name: Ratio} of a `picture` (H, W, 3); raises NeumatError for another size than the crops'.

        names: which of the statistics (None: all that the crops were described by).
        """
        if picture.shape != self.size:
            raise NeumatError(
                "comparison of textures", f"a picture of the crops' size {tuple(self.size)}", tuple(picture.shape)
            )
        return self.ratios(describe(picture, self.exemplar, names or self.statistics))

    def ratios(self, described):
        """Return {name: Ratio} of a picture of the crops' size, {name: what `describe` saw}."""
        found = {}
        for name, description in described.items():
            value = _distance(self.statistics[name], description, self.described[name])
            found[name] = Ratio(value, self.among[name].mean().item(), self.among[name].std().item())
        return found


def _distance(statistic, a, b):
    return torch.stack([statistic.distance(x, b) for x in a]).mean().item()


def windows(picture, exemplar):
    """Return the windows (n, 3, exemplar, exemplar) of a picture, side by side."""
    return (
        picture.permute(2, 0, 1)
        .unfold(1, exemplar, exemplar)
        .unfold(2, exemplar, exemplar)
        .flatten(1, 2)
        .transpose(0, 1)
    )


def sorted_channels(picture, exemplar):
    """Return the sorted values (n, 3, pixels) of the channels of each window."""
    return windows(picture, exemplar).flatten(2).sort().values


def sorted_projections(picture, exemplar):
    """Return the sorted projections (n, 16, pixels) of the colours of each window on directions all over the sphere."""
    k = torch.arange(16) + 0.5
    z, phi = 1 - k / 16, math.pi * (1 + 5**0.5) * k  # of half the sphere: a direction and its opposite are one
    directions = torch.stack([(1 - z * z).sqrt() * phi.cos(), (1 - z * z).sqrt() * phi.sin(), z], -1)
    return (directions @ windows(picture, exemplar).flatten(2)).sort().values


def wasserstein(a, b):
    """Return 1-Wasserstein distances (n,) of sorted values (k, pixels) and (n, k, pixels), the mean over k."""
    return (a - b).abs().mean((-2, -1))


def log_spectrum(picture, exemplar):
    """Return the logarithms (n, rings) of the power of up to 16 rings of frequencies, equal steps of log frequency, of
    each window with cosine borders; the sum over channels."""
    border = torch.hann_window(exemplar, periodic=False)
    tiles = windows(picture, exemplar)
    power = torch.fft.fft2((tiles - tiles.mean((2, 3), keepdim=True)) * border * border[:, None]).abs().square().sum(1)
    f = torch.fft.fftfreq(exemplar, 1 / exemplar)
    radius = f.square().add(f[:, None].square()).sqrt()
    ring = (16 * torch.log(radius / 1.5) / math.log(exemplar / 3)).floor()
    used = [ring == k for k in range(16) if (ring == k).any()]
    rings = torch.stack([power[:, pixels].mean(1) for pixels in used], -1)
    # Below 1e-7 of the mean there is nothing to see.
    return torch.log(rings + 1e-7 * rings.mean(1, keepdim=True) + 1e-20)


def root_mean_square(a, b):
    """Return the root mean square differences (n,) of a description and n others."""
    return (a - b).flatten(1).square().mean(1).sqrt()


def autocorrelation(pictures, lags):
    """Return the autocovariance over the variance of `pictures` (n, c, H, W), the sum over channels, at lags -lags to
    lags: (n, 2 lags + 1, 2 lags + 1), lag 0 in the middle. Each lag is the mean over the pairs of pixels there are."""
    height, width = pictures.shape[-2:]
    centred = (pictures - pictures.mean((2, 3), keepdim=True)).double()
    size = (height + lags, width + lags)
    sums = torch.fft.irfft2(torch.fft.rfft2(centred, size).abs().square().sum(1), size)
    lag = torch.arange(-lags, lags + 1)
    covariance = sums[:, lag][:, :, lag] / ((height - lag.abs())[:, None] * (width - lag.abs()))
    return covariance / covariance[:, lags, lags, None, None].clamp_min(1e-20)


def near_autocorrelation(picture, exemplar):
    """Return the autocorrelation of each window at lags up to half an exemplar."""
    return autocorrelation(windows(picture, exemplar), exemplar // 2)


def far_autocorrelation(picture, exemplar):
    """Return the picture's autocorrelation at lags of a quarter exemplar and more, up to half the picture, and the
    largest one within an eighth of an exemplar of each lag: (1, 2, lags)."""
    lags = min(picture.shape[:2]) // 2
    lag = torch.arange(-lags, lags + 1).abs()
    far = torch.maximum(lag, lag[:, None]) >= exemplar // 4
    here = autocorrelation(picture.permute(2, 0, 1)[None], lags)
    near = torch.nn.functional.max_pool2d(here, 2 * (exemplar // 8) + 1, 1, exemplar // 8)
    return torch.stack([here[:, far], near[:, far]], 1)


def largest_excess(a, b):
    """Return by how much the first of descriptions exceeds what n others have near the same lag, where it does so most;
    0 where nowhere.

    Near: a lattice may differ a little in its period, which is no repetition.
    """
    return (a[0] - b[:, 1]).amax(1).clamp_min(0)


def patches(picture, exemplar):
    """Return 4500 patches of 8 x 8 pixels from random places of a picture, as rows (1, 4500, 192)."""
    generator = torch_generator(0, "patches")
    tiles = picture.unfold(0, PATCH, 1).unfold(1, PATCH, 1)
    i, j = (torch.randint(0, n, (4500,), generator=generator) for n in tiles.shape[:2])
    return tiles[i, j].flatten(1)[None]


def ghosts(a, b):
    """Return how far 500 patches of `a` are from the nearest of `b` (n, ...): root mean square over pixels."""
    return torch.stack([torch.cdist(a[:500], rows[500:]).amin(1).mean() for rows in b]) / a.shape[1] ** 0.5


def coverage(a, b):
    """Return how far patches of `b`, the truth, are from the nearest of `a`."""
    return torch.cat([ghosts(rows, a[None]) for rows in b])


def copies(picture, exemplar):
    """Return the largest share of windows, a quarter exemplar wide, that appear again at one and the same offset.

    A window appears again where its correlation with the picture there is above ALIKE. Offsets are at least half a
    window and up to half the picture; one counts if at least a third of the windows have it inside the picture.
    """
    grey = picture.mean(-1).double()
    height, width = grey.shape
    side = max(8, exemplar // 4)
    grey = grey - grey.mean()
    generator = torch_generator(0, "copies")
    tops, lefts = (torch.randint(0, n - side, (WINDOWS,), generator=generator) for n in grey.shape)
    spectrum = torch.fft.rfft2(grey)
    sums = _box_sums(grey, side), _box_sums(grey.square(), side)
    spread = (sums[1] - sums[0].square() / side**2).clamp_min(1e-12).sqrt()
    rows, columns = height // 2, width // 2
    hits, valid = torch.zeros(2 * rows + 1, 2 * columns + 1), torch.zeros(2 * rows + 1, 2 * columns + 1)
    for top, left in zip(tops.tolist(), lefts.tolist(), strict=True):
        window = grey[top : top + side, left : left + side]
        window = window - window.mean()
        products = torch.fft.irfft2(spectrum * torch.fft.rfft2(window, grey.shape).conj(), grey.shape)
        alike = products[: height - side + 1, : width - side + 1] > ALIKE * spread * window.norm().clamp_min(1e-6)
        y, x = max(0, top - rows), max(0, left - columns)  # the first place within the offsets
        part = alike[y : top + rows + 1, x : left + columns + 1]
        y, x = y - top + rows, x - left + columns
        hits[y : y + part.shape[0], x : x + part.shape[1]] += part
        valid[y : y + part.shape[0], x : x + part.shape[1]] += 1
    far = torch.maximum(torch.arange(-rows, rows + 1).abs()[:, None], torch.arange(-columns, columns + 1).abs())
    usable = (far >= side // 2) & (valid >= WINDOWS / 3)
    # Three pixels wide, since resampled copies are not at whole offsets.
    share = torch.nn.functional.max_pool2d((hits / valid.clamp_min(1))[None], 3, 1, 1)[0]
    return share[usable].max()[None]


def _box_sums(x, side):
    total = torch.nn.functional.pad(x.cumsum(0).cumsum(1), (1, 0, 1, 0))
    return total[side:, side:] - total[:-side, side:] - total[side:, :-side] + total[:-side, :-side]


def own(a, b):
    """Return `a`, a number that says all by itself."""
    return a


def deep_features(picture, exemplar):
    """Return EfficientNet-Lite0's features of half-overlapping crops, one exemplar wide: (1, n, 1280)."""
    tiles = picture.unfold(0, exemplar, exemplar // 2).unfold(1, exemplar, exemplar // 2).flatten(0, 1)
    return frechet.features((tiles.permute(0, 2, 3, 1).clamp(0, 1) * 255).round().byte())[None]


def frechet_distances(a, b):
    """Return the Frechet distances (n,) of features (k, d) from n others."""
    return torch.tensor([frechet.frechet(a, rows) for rows in b])


STATISTICS = {
    "histogram": Statistic(sorted_channels, wasserstein),
    "colours": Statistic(sorted_projections, wasserstein),
    "spectrum": Statistic(log_spectrum, root_mean_square),
    "autocovariance": Statistic(near_autocorrelation, root_mean_square),
    "ghosts": Statistic(patches, ghosts),
    "coverage": Statistic(patches, coverage),
    "repetition": Statistic(far_autocorrelation, largest_excess),
    "copies": Statistic(copies, own),
    "frechet": Statistic(deep_features, frechet_distances),
}
