"""How corner tiles are cut out of an exemplar.

Round each corner of one colour is one patch of the exemplar, along each edge between two colours another, and each tile
has its own inside. Each is chosen to fit to the patches that it overlaps, and joined along cuts of least error.
"""

from typing import NamedTuple

import torch

from neumat.btf.synthesis.cuts import beyond_cut, comparable, fitting, mismatches

LAYERS = 9  # patches in a tile: the inside, four along edges, four round corners
MARGIN = 6  # parts of a tile's shorter side; one is the distance from the border within which the inside is joined


class Tiles(NamedTuple):
    """What tiles show: sample (y, x) of tile t shows texel (rows[t, k] + y, columns[t, k] + x) of the exemplar, modulo
    its size, with k = layers[t, y, x]."""

    layers: torch.Tensor  # (tiles, R, C), uint8
    rows: torch.Tensor  # (tiles, LAYERS), int32
    columns: torch.Tensor


class Strips(NamedTuple):
    """Strips along the edges between two colours, samples -margin to margin across and 0 to the tile's side along."""

    layers: torch.Tensor  # (colours, colours, 2 margin + 1, length + 1), 0 middle, 1 first corner's patch, 2 second's
    first: torch.Tensor  # (colours, colours, 2): row and column of the texel that the middle shows at sample (0, 0)


def cut_tiles(plane, correlation, colours, columns, rows, tileable, generator):
    """Return the Tiles, colours^4 of (rows + 1) x (columns + 1) samples, of a `plane` (H, W, c).

    Tile ((a n + b) n + c) n + d of n colours has a, b at its upper corners and c, d at its lower ones. Tiles with equal
    colours at two corners show equal texels on the edge between them. correlation: as from `lattice.autocovariance`.
    """
    device = plane.device
    margin = min(rows, columns) // MARGIN
    centres = _centres(correlation, colours, tileable, 2 * margin, generator).to(device)
    a, b, c, d = torch.cartesian_prod(*[torch.arange(colours, device=device)] * 4).unbind(1)
    first = torch.zeros(len(a), LAYERS, 2, dtype=torch.int64, device=device)
    for k, (colour, i, j) in enumerate([(a, 0, 0), (b, 0, columns), (c, rows, 0), (d, rows, columns)]):
        first[:, 5 + k] = centres[colour] - torch.tensor([i, j], device=device)
    if margin == 0:
        y, x = torch.meshgrid(torch.arange(rows + 1) * 2 > rows, torch.arange(columns + 1) * 2 > columns, indexing="ij")
        layers = (5 + 2 * y.int() + x.int()).to(torch.uint8).to(device).expand(len(a), -1, -1).contiguous()
        return Tiles(layers, *(part.int().contiguous() for part in first.unbind(-1)))
    features = comparable(plane)
    across = _strips(features, centres, columns, margin, tileable, generator)
    down = _strips(features.transpose(1, 2), centres.flip(1), rows, margin, tileable, generator)
    # Each side's strip: its half inside the tile, and the layers of its middle, its first and its second corner.
    layers = torch.zeros(len(a), rows + 1, columns + 1, dtype=torch.uint8, device=device)
    sides = [
        (layers[:, : margin + 1], across.layers[a, b, margin:], (1, 5, 6)),
        (layers[:, -margin - 1 :], across.layers[c, d, : margin + 1], (2, 7, 8)),
        (layers[:, :, : margin + 1], down.layers[a, c, margin:].transpose(1, 2), (3, 5, 7)),
        (layers[:, :, -margin - 1 :], down.layers[b, d, : margin + 1].transpose(1, 2), (4, 6, 8)),
    ]
    for part, strip, names in sides:  # where two sides meet, both show the patch round the corner
        part.copy_(torch.tensor(names, dtype=torch.uint8, device=device)[strip.long()])
    first[:, 1] = across.first[a, b]
    first[:, 2] = across.first[c, d] - torch.tensor([rows, 0], device=device)
    first[:, 3] = down.first[a, c].flip(1)
    first[:, 4] = down.first[b, d].flip(1) - torch.tensor([0, columns], device=device)
    _fill(features, layers, first, margin, tileable, generator)
    return Tiles(layers, *(part.int().contiguous() for part in first.unbind(-1)))


def _centres(correlation, colours, tileable, margin, generator):
    """Return the rows and columns (colours, 2) of the patches round corners: places far apart that look alike."""
    height, width = ((n + 1) // 2 for n in correlation.shape)
    inside = [(0, n) if tileable or n <= 2 * margin else (margin, n - margin) for n in (height, width)]
    chosen = [[torch.randint(*bounds, (), generator=generator).item() for bounds in inside]]
    row, column = (torch.arange(*bounds) for bounds in inside)
    score = correlation.cpu()[row - chosen[0][0] + height - 1][:, column - chosen[0][1] + width - 1].clone()
    while len(chosen) < colours:
        apart = torch.maximum((row - chosen[-1][0]).abs()[:, None] / height, (column - chosen[-1][1]).abs() / width)
        score -= (apart < 0.15).double()
        best = score.argmax().item()
        chosen.append([row[best // len(column)].item(), column[best % len(column)].item()])
    return torch.tensor(chosen)


def _strips(features, centres, length, margin, tileable, generator):
    """Return the Strips between the patches round `centres` (colours, 2)."""
    device = features.device
    a, b = torch.cartesian_prod(*[torch.arange(len(centres), device=device)] * 2).unbind(1)
    left = centres[a] - torch.tensor([margin, 0], device=device)
    right = centres[b] - torch.tensor([margin, length], device=device)
    column = torch.arange(length + 1, device=device)
    second = (column * 2 > length).expand(2 * margin + 1, -1)
    ends = torch.where(second, _patches(features, right, *second.shape), _patches(features, left, *second.shape))
    # The middle overlaps what is round the corners between `margin` and twice that from them.
    inner = slice(margin, length + 1 - margin)
    known = ((column <= 2 * margin) | (column >= length - 2 * margin))[inner].expand(2 * margin + 1, -1)
    targets = ends[..., inner]
    first = fitting(mismatches(features, targets, known, tileable), generator)
    error = (targets - _patches(features, first, *known.shape)).square().sum(1)
    layers = (1 + second.to(torch.uint8)).repeat(len(a), 1, 1)
    layers[..., inner][beyond_cut(error, margin + 1, 2, False) & beyond_cut(error, margin + 1, 2, True)] = 0
    # Of the sample in the middle of the strip's beginning.
    first = first + torch.tensor([margin, -margin], device=device)
    shape = (len(centres), len(centres))
    return Strips(layers.unflatten(0, shape), first.unflatten(0, shape))


def _fill(features, layers, first, margin, tileable, generator):
    """Fill the inside of tiles, layer 0, and set where it begins, `first` [:, 0], in place."""
    height, width = features.shape[1:]
    inner = layers[:, 1:-1, 1:-1]
    y, x = (torch.arange(1, n - 1, device=layers.device) for n in layers.shape[1:])
    source = torch.gather(first, 1, inner.flatten(1).long()[..., None].expand(-1, -1, 2)).unflatten(1, inner.shape[1:])
    row, column = (source[..., 0] + y[:, None]).remainder(height), (source[..., 1] + x).remainder(width)
    targets = features[:, row, column].transpose(0, 1)
    places = fitting(_frame_mismatches(features, targets, margin, tileable), generator)
    error = (targets - _patches(features, places, *inner.shape[1:])).square().sum(1)
    inside = [beyond_cut(error, margin, dimension, flip) for dimension in (1, 2) for flip in (False, True)]
    inner[torch.stack(inside).all(0)] = 0
    first[:, 0] = places - 1


def _frame_mismatches(features, targets, margin, tileable):
    """Return the mismatches (colours^4, H', W') of patches to `targets` (colours^4, k, h, w) within `margin` of their
    borders: the sum over sides of what depends on the two colours of each side only."""
    colours = round(len(targets) ** 0.25)
    targets = targets.unflatten(0, (colours,) * 4)
    known = torch.zeros(4, *targets.shape[-2:], dtype=torch.bool, device=features.device)
    known[0, :, :margin] = known[1, :, -margin:] = True
    known[2, :margin, margin:-margin] = known[3, -margin:, margin:-margin] = True
    total = 0
    for zone, (first, second) in zip(known, ((0, 2), (1, 3), (0, 1), (2, 3)), strict=True):
        others = [slice(None) if k in (first, second) else 0 for k in range(4)]
        errors = mismatches(features, targets[tuple(others)].flatten(0, 1), zone, tileable)
        shape = [colours if k in (first, second) else 1 for k in range(4)]
        total = total + errors.reshape(*shape, *errors.shape[1:])
    return total.flatten(0, 3)


def _patches(features, first, height, width):
    """Return patches (n, k, height, width) of `features` (k, H, W), wrapped, whose first texels are `first` (n, 2)."""
    rows = (first[:, :1] + torch.arange(height, device=first.device)).remainder(features.shape[1])
    columns = (first[:, 1:] + torch.arange(width, device=first.device)).remainder(features.shape[2])
    return features[:, rows[:, :, None], columns[:, None]].transpose(0, 1)
