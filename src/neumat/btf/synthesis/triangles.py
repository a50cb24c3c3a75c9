"""Patches on a grid of triangles, three over each position (Heitz and Neyret 2018, section 4).

Each vertex of the grid has a patch of the exemplar, in its position drawn by a hash, which covers the hexagon of the
six triangles round the vertex. Heitz and Neyret's triangles are equilateral with sides of 1 / (2 sqrt 3) exemplars;
here they are 2/7 wide and 1/4 high, 1 % from that: rational numbers, so that the grid is exact at any distance.
"""

import math

import torch

from neumat.btf.hashing import hashed_integers


class Grid:
    """The patches of an exemplar of `height` x `width` texels.

    tileable: patches wrap round the exemplar; if not, they keep within its border wherever it is large enough.
    """

    def __init__(self, height, width, seed, tileable):
        self.sizes, self.seed = (width, height), seed
        if tileable:
            self.ranges = [(0, width), (0, height)]
        else:
            self.ranges = [_inside(width, 2 / 7), _inside(height, 1 / 4)]

    def patches(self, cell, fraction):
        """Return positions in the exemplar (n, 3, 2), float64, and barycentric weights (n, 3), float32.

        A position differs from the query's by whole texels, so that fetches blur no patch more than the exemplar.
        """
        vertices, offsets, weights = self._vertices(cell, fraction)
        draw = hashed_integers(torch.stack(vertices, -1), self.seed)
        draws = draw & 0xFFFF, draw >> 16
        # Centres of patches in the endless plane, times `parts`, in exemplars.
        centres = [(2 * vertices[0] + vertices[1], 7), (vertices[1], 4)]
        positions = []
        for (first, count), size, offset, (centre, parts), number in zip(
            self.ranges, self.sizes, offsets, centres, draws, strict=True
        ):
            rest = (centre * size).remainder(parts)  # from the texel grid to the centre, in 1 / parts of a texel
            rest = torch.where(2 * rest > parts, rest - parts, rest)
            positions.append(offset + (rest.double() / parts + (first + (number * count >> 16))) / size)
        return torch.stack(positions, -1), weights.float()

    def usage(self, device):
        """Return how often each texel (H, W) of the exemplar appears, float64 with mean 1: in one that does not tile
        those near the border appear less than others."""
        if self.ranges == [(0, size) for size in self.sizes]:
            return torch.ones(self.sizes[::-1], dtype=torch.float64, device=device)
        x, y = (torch.arange(1 - size, size, dtype=torch.float64, device=device) / size for size in self.sizes)
        y = (4 * y)[:, None]
        x = (7 * x - y) / 2
        # A patch's barycentric weight is a pyramid; blending counts its square, by and large.
        kernel = (1 - torch.maximum(torch.maximum(x.abs(), y.abs()), (x + y).abs())).clamp_min(0).square()
        (left, columns), (top, rows) = self.ranges
        centres = torch.zeros(self.sizes[::-1], dtype=torch.float64, device=device)
        centres[top : top + rows, left : left + columns] = 1
        return usage(centres, kernel)

    def _vertices(self, cell, fraction):
        """Return the vertices (x and y (n, 3), int64) round positions, the positions' distances from them in exemplars
        (x and y (n, 3)), and their weights (n, 3)."""
        # Skewed coordinates, (7 x - 4 y) / 2 and 4 y: whole numbers at the vertices.
        x = 7 * fraction[:, 0] - 4 * fraction[:, 1]
        y = 4 * fraction[:, 1]
        whole_x, whole_y = torch.floor(x), torch.floor(y)
        halves = 7 * cell[:, 0] - 4 * cell[:, 1] + whole_x.long()
        column, row = halves >> 1, 4 * cell[:, 1] + whole_y.long()
        x, y = ((halves & 1) + (x - whole_x)) / 2, y - whole_y
        upper = x + y >= 1  # the triangle of vertex (1, 1), else that of (0, 0)
        corner = upper.long()
        zero, one = torch.zeros_like(corner), torch.ones_like(corner)
        columns, rows = torch.stack([corner, one, zero], -1), torch.stack([corner, zero, one], -1)
        weights = torch.stack([(1 - x - y).abs(), torch.where(upper, 1 - y, x), torch.where(upper, 1 - x, y)], -1)
        from_x, from_y = x[:, None] - columns, y[:, None] - rows
        vertices = column[:, None] + columns, row[:, None] + rows
        return vertices, ((2 * from_x + from_y) / 7, from_y / 4), weights


def usage(places, patch):
    """Return how often each texel (H, W) of an exemplar appears, float64 with mean 1, if it is covered by a `patch`
    (2 H - 1, 2 W - 1), weights about its centre, whose centre is at each texel with the probability `places` (H, W)."""
    height, width = places.shape
    size = (3 * height, 3 * width)
    sums = torch.fft.irfft2(torch.fft.rfft2(places, size) * torch.fft.rfft2(patch, size), size)
    sums = sums[height - 1 : 2 * height - 1, width - 1 : 2 * width - 1].clamp_min(0)
    return sums / sums.mean()


def _inside(size, half):
    """Return the first and the number of texels on which patches of `half` x 2 exemplars can be centred."""
    first = math.ceil(half * size + 1)
    last = math.floor((1 - half) * size - 1)
    return (first, last - first + 1) if first <= last else (size // 2, 1)
