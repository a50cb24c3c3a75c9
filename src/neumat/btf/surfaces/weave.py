"""A plain or twill weave: two sets of threads that pass over and under each other."""

import torch

from neumat.btf.surfaces.lattice import Lattice, fractal, noise, smoothstep

PLIES = 2  # ridges of the yarn's twist that cross a thread in each cell


def weave(points, seed, period, repeats, over, under, irregularity):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 the warp, along y, 1 the weft, along x.

    repeats: of the pattern along a side; over, under: how many wefts a warp thread passes over, then under (1 and 1
    is a plain weave, 2 and 2 a twill); irregularity: how far threads stray, in threads.
    """
    pattern = over + under
    threads = repeats * pattern
    lattice = Lattice([threads, threads], seed, period)
    moved = torch.stack(
        [
            noise(points, [threads, max(threads // 3, 1)], seed, period, 10),
            noise(points, [max(threads // 3, 1), threads], seed, period, 11),
        ]
    )
    cells, fractions = lattice.locate(points, moved * irregularity / threads)
    offset = fractions - 0.5
    side = torch.where(offset < 0, -1, 1)
    aside, bend = offset.abs(), smoothstep(offset.abs())

    def lifted(i, j):
        """1 where the warp thread i lies above the weft thread j, else -1."""
        return torch.where((i - j) % pattern < over, 1.0, -1.0)

    here = lifted(cells[0], cells[1])
    warp = here + bend[1] * (lifted(cells[0], cells[1] + side[1]) - here)
    weft = -(here + bend[0] * (lifted(cells[0] + side[0], cells[1]) - here))
    round_ = 1 - 4 * aside * aside
    thickness = 1 + irregularity * torch.stack(
        [
            noise(points, [threads, max(threads // 4, 1)], seed, period, 12),
            noise(points, [max(threads // 4, 1), threads], seed, period, 13),
        ]
    )
    twist = torch.stack([fractions[1] * PLIES + fractions[0], fractions[0] * PLIES - fractions[1]])
    twist = twist - twist.floor() - 0.5
    yarn = round_ * thickness + 0.22 * round_ * (1 - 4 * twist * twist)
    fuzz = 0.08 * fractal(points, [4 * threads] * 2, seed, period, 2, 20)
    warp, weft = warp + yarn[0], weft + yarn[1]
    return torch.maximum(warp, weft) + fuzz, (weft > warp).long()
