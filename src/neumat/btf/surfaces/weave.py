"""A plain or twill weave: two sets of threads that pass over and under each other."""

import torch

from neumat.btf.surfaces.lattice import Lattice, noise, smoothstep

PLIES = 2  # ridges of the yarn's twist that cross a thread in each cell
FLOOR = -0.1  # of the gaps between threads: no edge of a thread is above it


def weave(points, seed, period, repeats, over, under, irregularity):
    """Return the heights (n,) and materials (n,) at points (2, n): 0 the warp, along y, 1 the weft, along x.

    repeats: of the pattern along a side; over, under: how many wefts a warp thread passes over, then under (1 and 1
    is a plain weave, 2 and 2 a twill); irregularity: how far threads stray, in threads.
    """
    pattern = over + under
    threads = repeats * pattern
    long = [[threads, max(threads // 3, 1)], [max(threads // 3, 1), threads]]  # along the warp, along the weft
    moved = torch.stack([noise(points, counts, seed, period, 10 + k) for k, counts in enumerate(long)])
    thickness = torch.stack([noise(points, counts, seed, period, 12 + k) for k, counts in enumerate(long)])
    cells, fractions = Lattice([threads, threads], seed, period).locate(points, moved * (irregularity / threads))
    offset = fractions - 0.5
    side, aside = torch.where(offset < 0, -1, 1), offset.abs()

    def lifted(i, j):
        """1 where the warp thread i lies above the weft thread j, else -1."""
        return torch.where((i - j) % pattern < over, 1.0, -1.0)

    here, bend = lifted(cells[0], cells[1]), smoothstep(aside)
    warp = here + bend[1] * (lifted(cells[0], cells[1] + side[1]) - here)
    weft = -here - bend[0] * (lifted(cells[0] + side[0], cells[1]) - here)
    square = 4 * aside * aside
    twist = torch.stack([fractions[1] * PLIES + fractions[0], fractions[0] * PLIES - fractions[1]])
    twist = twist - twist.floor() - 0.5
    yarn = (1 - square) * (1 + irregularity * thickness - 0.9 * twist * twist) - 1.15 * square * square * square
    fuzz = 0.1 * noise(points, [5 * threads] * 2, seed, period, 20)
    warp, weft = warp + yarn[0], weft + yarn[1]
    return torch.maximum(warp, weft).clamp_min(FLOOR) + fuzz, (weft > warp).long()
