"""Image quilting (Efros and Freeman 2001): stored, the quality that dynamic methods are compared with."""

import torch

from neumat.btf.planes import fetch
from neumat.btf.synthesis.base import Synthesis
from neumat.btf.synthesis.cuts import beyond_cut, comparable, fitting
from neumat.seeds import torch_generator

BLOCK, OVERLAP = 0.3, 0.06  # sides of blocks and of what they share with their neighbours, in exemplars
SAMPLES = 4  # texels along a side of the footprint of a level's texel, at most, that are looked up
CANDIDATES = 3000  # places of the exemplar that each block is chosen from


class Quilting(Synthesis):
    """Blocks of the exemplar, each chosen to fit to the blocks before it and joined along cuts of least error.

    The whole plane of `extent` exemplars is made at once, its opposite borders joined too, and repeats beyond.
    """

    dynamic = False

    def __init__(self, plane, seed, tileable=False, levels=None, extent=4):
        super().__init__(plane, seed, tileable, levels)
        self.extent = extent
        self.base = plane[0, 0]
        texels = quilt(plane, (extent * self.height, extent * self.width), torch_generator(seed, "quilting"), tileable)
        self.levels = [self._level(k, texels) for k in range(self.top + 1)]
        self.stored = [*self.levels, self.base]

    def _features(self, cell, fraction, level):
        u = (cell.remainder(self.extent) + fraction) / self.extent
        return fetch(self.levels[min(level, self.top)], u, wrap=True) + self.base

    def _level(self, k, texels):
        """Return level k of the quilt whose texels (R, C) are those of the exemplar.

        A texel of it is the mean over up to SAMPLES x SAMPLES of the texels under it: of the exemplar's level, where
        the patch that a texel belongs to, continued, has the middle of all.
        """
        (y, from_y), (x, from_x) = (_footprints(size, k) for size in texels.shape)
        at = texels[y.flatten().to(texels.device)][:, x.flatten().to(texels.device)]
        row, column = at // self.width + 0.5 + from_y.reshape(-1, 1).to(at.device), at % self.width + 0.5
        position = torch.stack([(column + from_x.flatten().to(at.device)) / self.width, row / self.height], -1)
        fetched = fetch(self.exemplar[k] - self.base, position.flatten(0, 1), self.tileable)
        return fetched.view(*y.shape, *x.shape, -1).mean((1, 3))


def quilt(plane, size, generator, tileable=False):
    """Return the texels (R, C), as H W indices of a `plane` (H, W, c), of a quilt of `size` (R, C) that tiles.

    A block is placed when those left of and above it are; blocks that don't wait for each other are placed together.
    """
    height, width, _ = plane.shape
    axes = [_blocks(total, side) for total, side in zip(size, (height, width), strict=True)]
    (tops, tall, over_y), (lefts, wide, over_x) = axes
    block_y, block_x = torch.arange(tall, device=plane.device), torch.arange(wide, device=plane.device)
    room = [n if tileable else max(1, n - b + 1) for n, b in ((height, tall), (width, wide))]
    places = torch.randperm(room[0] * room[1], generator=generator)[:CANDIDATES].to(plane.device)
    rows = (places[:, None] // room[1] + block_y).remainder(height)
    columns = (places[:, None] % room[1] + block_x).remainder(width)
    candidates = rows[:, :, None] * width + columns[:, None]
    # The borders, which may overlap other blocks.
    border = torch.ones(tall, wide, dtype=torch.bool, device=plane.device)
    border[over_y : tall - over_y, over_x : wide - over_x] = False
    features = comparable(plane).flatten(1).T
    offered = features[candidates[:, border]]
    energy = offered.square().sum(2)

    quilted = torch.zeros(size, dtype=torch.int64, device=plane.device)
    i, j = torch.meshgrid(torch.arange(len(tops)), torch.arange(len(lefts)), indexing="ij")
    wave = 2 * i + j  # a block overlaps the one right of that above it, too
    for k in range(int(wave.max()) + 1):
        i_now, j_now = i[wave == k], j[wave == k]
        known = torch.stack([i_now > 0, i_now == len(tops) - 1, j_now > 0, j_now == len(lefts) - 1], 1).to(plane.device)
        rows = (tops[i_now].to(plane.device)[:, None] + block_y).remainder(size[0])[:, :, None]
        columns = (lefts[j_now].to(plane.device)[:, None] + block_x).remainder(size[1])[:, None]
        before = quilted[rows, columns]
        mask = _overlaps(known, tall, wide, over_y, over_x)[:, border].to(features.dtype)
        wanted = features[before[:, border]] * mask[..., None]
        errors = mask @ energy.T - 2 * wanted.flatten(1) @ offered.flatten(1).T + wanted.square().sum((1, 2))[:, None]
        chosen = candidates[fitting(errors.clamp_min(0)[:, None], generator)[:, 1]]
        error = (features[before] - features[chosen]).square().sum(3)
        for side, (dimension, flip) in enumerate(((1, False), (1, True), (2, False), (2, True))):
            inside = beyond_cut(error, over_y if dimension == 1 else over_x, dimension, flip)
            chosen = torch.where(inside | ~known[:, side, None, None], chosen, before)
        quilted[rows, columns] = chosen
    return quilted


def _footprints(size, k):
    """Return texels (n, s), int64, spread over each of the n texels of level k of `size` texels, and how far from each
    the middle of its footprint is, in texels."""
    count, samples = -(-size // 2**k), min(SAMPLES, 2**k)
    wide = size / count
    texel = torch.arange(count, dtype=torch.float64)[:, None]
    chosen = ((texel + (torch.arange(samples) + 0.5) / samples) * wide).long()
    return chosen, (texel + 0.5) * wide - 0.5 - chosen


def _blocks(total, side):
    """Return where blocks begin (n,), their size and their overlap, in texels, over `total` texels of a quilt."""
    overlap = max(1, round(OVERLAP * side))
    count = max(2, round(total / (BLOCK * side)))
    return torch.arange(count) * total // count, -(-total // count) + overlap, overlap


def _overlaps(known, tall, wide, over_y, over_x):
    """Return the texels (n, tall, wide) of blocks that overlap others on the sides `known` (n, 4)."""
    y, x = torch.arange(tall, device=known.device)[:, None], torch.arange(wide, device=known.device)
    sides = [y < over_y, y >= tall - over_y, x < over_x, x >= wide - over_x]
    return sum(known[:, k, None, None] & side for k, side in enumerate(sides)) > 0
