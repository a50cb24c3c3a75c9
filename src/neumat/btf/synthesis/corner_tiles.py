"""How corner tiles are cut out of an exemplar.

Round each corner of one colour is one patch of the exemplar, along each edge between two colours another, and each tile
has its own inside. Each is chosen to fit to the patches that it overlaps, and joined along cuts of least error.
"""

from typing import NamedTuple

import torch

from neumat.btf.synthesis.cuts import beyond_cut, fitting, mismatches
from neumat.btf.synthesis.lattice import autocovariance

LAYERS = 9  # patches in a tile: the inside, four along the upper, lower, left and right edge, four round corners
ANCHORS = [(0, 0), (0, 0), (0, 1), (0, 0), (1, 0), (0, 0), (1, 0), (0, 1), (1, 1)]  # corners, x and y, they go with
MARGIN = 6  # parts of a tile's shorter side; one is the distance from the border within which the inside is joined


class Strips(NamedTuple):
    """Strips along the edges between two colours, samples -margin to margin across and 0 to the tile's side along."""

    layers: torch.Tensor  # (colours, colours, 2 margin + 1, length + 1), 0 middle, 1 first corner's patch, 2 second's
    first: torch.Tensor  # (colours, colours, 2): row and column of what the middle shows at the first corner


def cut_tiles(frame, colours, columns, rows, generator):
    """Return how tiles of (rows + 1) x (columns + 1) samples are cut out of a `frame.Frame`.

    Returns the layer of each sample (colours^4, rows + 1, columns + 1), uint8, and the row and column of the frame's
    sample that each layer shows at its anchor, the corner that ANCHORS says: (colours^4, LAYERS, 2), int64. Tile
    ((a n + b) n + c) n + d of n colours has a, b at its upper corners and c, d at its lower ones. Tiles with equal
    colours at two corners have the same layers and show the same on the edge between them.
    """
    features = frame.features
    device = features.device
    margin = min(rows, columns) // MARGIN
    centres = _centres(frame, colours, 2 * margin, generator).to(device)
    a, b, c, d = torch.cartesian_prod(*[torch.arange(colours, device=device)] * 4).unbind(1)
    first = torch.zeros(len(a), LAYERS, 2, dtype=torch.int64, device=device)
    for k, colour in enumerate((a, b, c, d)):
        first[:, 5 + k] = centres[colour]
    if margin == 0:
        y, x = torch.meshgrid(torch.arange(rows + 1) * 2 > rows, torch.arange(columns + 1) * 2 > columns, indexing="ij")
        return (5 + 2 * y.int() + x.int()).to(torch.uint8).to(device).expand(len(a), -1, -1).contiguous(), first
    across = _strips(features, centres, columns, margin, frame.room, generator)
    down = _strips(features.transpose(1, 2), centres.flip(1), rows, margin, lambda h, w: frame.room(w, h).T, generator)
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
    first[:, 1], first[:, 2] = across.first[a, b], across.first[c, d]
    first[:, 3], first[:, 4] = down.first[a, c].flip(1), down.first[b, d].flip(1)
    _fill(frame, layers, first, margin, generator)
    return layers, first


def _centres(frame, colours, margin, generator):
    """Return the rows and columns (colours, 2) of the patches round corners: places far apart that look alike."""
    features = frame.features
    height, width = features.shape[1:]
    correlation = autocovariance(features.permute(1, 2, 0), False).cpu()
    room = torch.zeros(height, width, dtype=torch.bool)
    if min(height, width) > 2 * margin:
        inner = frame.room(2 * margin + 1, 2 * margin + 1).cpu()
        room[margin : margin + inner.shape[0], margin : margin + inner.shape[1]] = inner
    places = room.nonzero() if room.any() else torch.tensor([[height // 2, width // 2]])
    chosen = [places[torch.randint(len(places), (), generator=generator)]]
    score = correlation[tuple((places - chosen[0] + torch.tensor([height - 1, width - 1])).T)]
    while len(chosen) < colours:
        apart = ((places - chosen[-1]).abs() / torch.tensor([height, width])).amax(1)
        score = score - (apart < 0.15).double()
        chosen.append(places[score.argmax()])
    return torch.stack(chosen)


def _strips(features, centres, length, margin, room, generator):
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
    first = fitting(mismatches(features, targets, known), generator, room(*known.shape))
    error = (targets - _patches(features, first, *known.shape)).square().sum(1)
    layers = (1 + second.to(torch.uint8)).repeat(len(a), 1, 1)
    layers[..., inner][beyond_cut(error, margin + 1, 2, False) & beyond_cut(error, margin + 1, 2, True)] = 0
    # Of the sample in the middle of the strip's beginning.
    first = first + torch.tensor([margin, -margin], device=device)
    shape = (len(centres), len(centres))
    return Strips(layers.unflatten(0, shape), first.unflatten(0, shape))


def _fill(frame, layers, first, margin, generator):
    """Fill the inside of tiles, layer 0, and set what it shows, `first` [:, 0], in place."""
    features = frame.features
    inner = layers[:, 1:-1, 1:-1]
    y, x = (torch.arange(1, n - 1, device=layers.device) for n in layers.shape[1:])
    rows, columns = (n - 1 for n in layers.shape[1:])
    anchors = torch.tensor([(rows * j, columns * i) for i, j in ANCHORS], device=layers.device)
    source = torch.gather(first - anchors, 1, inner.flatten(1).long()[..., None].expand(-1, -1, 2))
    source = source.unflatten(1, inner.shape[1:])
    # What is not yet known may lie outside.
    row = (source[..., 0] + y[:, None]).clamp(0, features.shape[1] - 1)
    column = (source[..., 1] + x).clamp(0, features.shape[2] - 1)
    targets = features[:, row, column].transpose(0, 1)
    places = fitting(_frame_mismatches(features, targets, margin), generator, frame.room(*inner.shape[1:]))
    error = (targets - _patches(features, places, *inner.shape[1:])).square().sum(1)
    inside = [beyond_cut(error, margin, dimension, flip) for dimension in (1, 2) for flip in (False, True)]
    inner[torch.stack(inside).all(0)] = 0
    first[:, 0] = places - 1


def _frame_mismatches(features, targets, margin):
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
        errors = mismatches(features, targets[tuple(others)].flatten(0, 1), zone)
        shape = [colours if k in (first, second) else 1 for k in range(4)]
        total = total + errors.reshape(*shape, *errors.shape[1:])
    return total.flatten(0, 3)


def _patches(features, first, height, width):
    """Return patches (n, k, height, width) of `features` (k, H, W) whose first samples are `first` (n, 2); samples
    beyond the border are those next to it."""
    rows = (first[:, :1] + torch.arange(height, device=first.device)).clamp(0, features.shape[1] - 1)
    columns = (first[:, 1:] + torch.arange(width, device=first.device)).clamp(0, features.shape[2] - 1)
    return features[:, rows[:, :, None], columns[:, None]].transpose(0, 1)
