"""Seams of a synthesised texture: steps across borders that are known, beside those of the truth, which has none."""

import torch

from neumat.metrics.textures import Ratio

SHIFTS = 32  # places of borders in a crop of the truth


def seams(picture, columns, rows):
    """Return the mean absolute step across borders over that between other neighbours, of a picture (H, W, 3).

    columns, rows: whole numbers; a border lies left of each pixel column and above each pixel row that they name.
    """
    return _across(_steps(picture), torch.as_tensor(columns).long() - 1, torch.as_tensor(rows).long() - 1)


def compare_seams(picture, crops, columns, rows):
    """Return the Ratio of `seams` of a picture to those of crops of the truth, as large, which have none.

    What the truth shows at borders depends on where they lie, so they are shifted to SHIFTS places in each crop.
    """
    columns, rows = torch.as_tensor(columns).long() - 1, torch.as_tensor(rows).long() - 1
    among = []
    for steps in map(_steps, crops):
        width, height = map(len, steps)
        for k in range(SHIFTS):
            shifted = (columns + k * width // SHIFTS) % width, (rows + k * height // SHIFTS) % height
            among.append(_across(steps, *shifted))
    among = torch.tensor(among, dtype=torch.float64)
    return Ratio(_across(_steps(picture), columns, rows), among.mean().item(), among.std().item())


def _steps(picture):
    """Return the mean absolute steps from each column to the next (W - 1,), and from each row (H - 1,)."""
    return picture.diff(dim=1).abs().mean((0, 2)), picture.diff(dim=0).abs().mean((1, 2))


def _across(steps, columns, rows):
    """Return the mean of the steps at `columns` and `rows` over that of the others."""
    border = torch.zeros(sum(map(len, steps)), dtype=torch.bool)
    border[columns], border[rows + len(steps[0])] = True, True
    steps = torch.cat(steps)
    return (steps[border].mean() / steps[~border].mean().clamp_min(1e-12)).item()
