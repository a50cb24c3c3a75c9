"""The regular part of an exemplar: its autocovariance, and the lags at which it looks like itself."""

import torch

PARTS = 16  # of a texel, to which the cells' sides are rounded: products of far cells and sides stay exact integers
CANDIDATES = 96  # peaks of the autocovariance that are tried as sides of cells


class Cells:
    """Cells between the lattice points i v + j w, for integers i, j and `sides` v, w in texels [(x, y), (x, y)].

    All arithmetic on cells is exact, at any distance.
    """

    def __init__(self, sides):
        (self.a, self.b), (self.c, self.d) = ([round(PARTS * x) for x in side] for side in sides)
        self.area = self.a * self.d - self.b * self.c
        self.middle = (self.a + self.c) / (2 * PARTS), (self.b + self.d) / (2 * PARTS)  # of cell (0, 0)
        self.box = [-(-(abs(v) + abs(w)) // PARTS) for v, w in ((self.a, self.c), (self.b, self.d))]

    def split(self, x, y, rest_x, rest_y):
        """Return the cells i, j, int64, and the places in them f, g, float64 in [0, 1), of texel coordinates, each an
        integer and a rest."""
        i, f = self._split(self.d * x - self.c * y, self.d * rest_x - self.c * rest_y)
        j, g = self._split(self.a * y - self.b * x, self.a * rest_y - self.b * rest_x)
        return i, j, f, g

    def _split(self, whole, rest):
        cell = torch.div(PARTS * whole, self.area, rounding_mode="floor")
        place = (PARTS * whole - cell * self.area + PARTS * rest) / self.area
        more = torch.floor(place)
        return cell + more.long(), place - more

    def point(self, m, n):
        """Return the texel (x, y), int64, nearest to m / 2 v + n / 2 w for integers m, n."""
        pairs = ((self.a, self.c), (self.b, self.d))
        return [torch.div(m * v + n * w + PARTS, 2 * PARTS, rounding_mode="floor") for v, w in pairs]


def whole_and_rest(cell, fraction, size, shift=0.0):
    """Return the texel coordinate `cell` + `fraction` times `size` plus `shift` as integers and rests in [0, 1)."""
    texel = fraction * size + shift
    whole = torch.floor(texel)
    return cell * size + whole.long(), texel - whole


def autocovariance(plane, tileable):
    """Return the autocorrelation (2 H - 1, 2 W - 1), float64, of a `plane` (H, W, c); lag 0 is in the middle.

    The sum over channels of the covariances over the sum of variances. A lag's covariance is the mean over the pairs of
    texels that the plane has, or over all pairs if it tiles.
    """
    height, width, _ = plane.shape
    centred = (plane - plane.mean((0, 1))).double().permute(2, 0, 1)
    size = (height, width) if tileable else (2 * height, 2 * width)
    sums = torch.fft.irfft2(torch.fft.rfft2(centred, size).abs().square().sum(0), size)
    y, x = (torch.arange(1 - n, n, device=plane.device) for n in (height, width))
    sums = sums[y.remainder(size[0])][:, x.remainder(size[1])]
    pairs = height * width if tileable else (height - y.abs())[:, None] * (width - x.abs())
    covariance = sums / pairs
    return covariance / covariance[height - 1, width - 1].clamp_min(1e-20)


def cell_sides(correlation, least, most):
    """Return two lags [(x, y), (x, y)], floats, and how alike the exemplar is at the less good of them. The lags span a
    cell on whose lattice the exemplar looks most like itself.

    correlation: as from `autocovariance`. The cell's bounding box is at most about `most` (x, y) texels, its area at
    least `least` texels. Lags are refined to parts of a texel.
    """
    height, width = ((n + 1) // 2 for n in correlation.shape)
    peaks = torch.nn.functional.max_pool2d(correlation[None], 5, 1, 2)[0] == correlation
    y, x = (torch.arange(1 - n, n) for n in (height, width))
    within = (x.abs() <= most[0]) & (y.abs() <= most[1])[:, None]
    half = (x > 0) | ((x == 0) & (y > 0)[:, None])  # a lag and its opposite span the same
    within = within & half & (torch.maximum(x.abs() / most[0], (y.abs() / most[1])[:, None]) > 0.15)
    score = torch.where(peaks.cpu() & within, correlation.cpu(), -1.0).flatten()
    best = score.topk(min(CANDIDATES, len(score)))
    lags = torch.stack([best.indices % len(x) - (width - 1), best.indices // len(x) - (height - 1)], -1)
    first, second = lags[:, None], lags[None]
    area = (first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]).abs()
    box = first.abs() + second.abs()
    fits = (box[..., 0] <= most[0]) & (box[..., 1] <= most[1]) & (area >= least)
    both = torch.minimum(best.values[:, None], best.values)
    # Of cells about equally good the larger: fewer borders.
    pair = torch.where(fits, both + 0.1 * area / (most[0] * most[1]), -torch.inf).flatten().argmax().item()
    if not fits.any():
        return [(float(most[0]), 0.0), (0.0, float(most[1]))], 0.0
    first, second = (_refined(correlation.cpu(), *lags[k].tolist()) for k in (pair // len(lags), pair % len(lags)))
    if first[0] * second[1] - first[1] * second[0] < 0:
        first, second = second, first
    return [first, second], both.flatten()[pair].item()


def _refined(correlation, x, y):
    """Return a peak's lag to parts of a texel; from the peak at twice the lag where there is one, twice as accurate."""
    height, width = ((n + 1) // 2 for n in correlation.shape)
    value = correlation[y + height - 1, x + width - 1]
    row, column = 2 * y + height - 1, 2 * x + width - 1
    if 3 <= row < 2 * height - 4 and 3 <= column < 2 * width - 4:
        around = correlation[row - 2 : row + 3, column - 2 : column + 3]
        if around.max() > 0.8 * value:
            k = around.argmax().item()
            peak = _vertex(correlation, row - 2 + k // 5, column - 2 + k % 5)
            return (peak[0] - width + 1) / 2, (peak[1] - height + 1) / 2
    return tuple(
        p - n + 1 for p, n in zip(_vertex(correlation, y + height - 1, x + width - 1), (width, height), strict=True)
    )


def _vertex(correlation, row, column):
    """Return the top (x, y) of the parabolas through a peak and its neighbours."""
    top = []
    for index, line in ((column, correlation[row]), (row, correlation[:, column])):
        before, here, after = (line[(index + step) % len(line)].item() for step in (-1, 0, 1))
        bend = 2 * here - before - after
        top.append(index + (max(-0.5, min(0.5, (after - before) / (2 * bend))) if bend > 0 else 0.0))
    return tuple(top)
