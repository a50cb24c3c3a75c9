"""Pictures of BTFs: feature planes, fits beside the truth, and synthesis methods beside a larger truth."""

import matplotlib
import numpy as np
import torch

from neumat.metrics.flip import flip
from neumat.reporting.style import figure, save_figure

INCHES, SHOWN = 1.25, 256  # along a side of a picture in a sheet, and its pixels
CAPTION = 7  # points


def picture_grid(rows, columns, pictures, path, captions=None, title="", enlarged=1.0):
    """Write pictures, uint8 [[(H, W, 3)]], as a PNG with names of rows and columns.

    None leaves a place empty. captions: None, or a text below each picture, [[str]]. enlarged: how much larger than
    usual they are.
    """
    size = INCHES * enlarged
    width, height = size * len(columns) + 0.3, (size + (0.16 if captions else 0.04)) * len(rows) + 0.3
    with figure(width, height, nrows=len(rows), ncols=len(columns), squeeze=False) as (drawn, axes):
        for i, j in np.ndindex(len(rows), len(columns)):
            axis, picture = axes[i, j], pictures[i][j]
            axis.set_xticks([])
            axis.set_yticks([])
            axis.grid(False)
            for side in axis.spines.values():
                side.set_visible(False)
            if picture is not None:
                axis.imshow(picture, interpolation="nearest" if len(picture) < SHOWN else "antialiased")
            if i == 0:
                axis.set_title(columns[j], fontsize=8, fontweight="normal", loc="center", pad=3)
            if j == 0:
                axis.set_ylabel(rows[i], fontsize=8)
            if captions and captions[i][j]:
                axis.set_xlabel(captions[i][j], fontsize=CAPTION, labelpad=1)
        drawn.suptitle(title, fontsize=9)
        save_figure(drawn, path, dpi=round(SHOWN / INCHES))


def error_map(expected, found):
    """Return FLIP's map of two sRGB pictures, uint8 (H, W, 3), in false colours: black is no error, yellow the most."""
    colours = matplotlib.colormaps["magma"](flip(expected, found))
    return (255 * colours[..., :3]).round().astype(np.uint8)


def false_colours(plane):
    """Return a plane of features (H, W, c) as uint8 (H, W, 3): its principal components as red, green and blue."""
    rows = torch.as_tensor(plane).flatten(0, 1).double()
    rows = rows - rows.mean(0)
    rank = min(3, rows.shape[1])
    axes = torch.linalg.svd(rows[:: max(1, len(rows) // 4096)], full_matrices=False)[2][:rank]
    axes = axes * axes.sum(1, keepdim=True).sign()  # an axis and its opposite are as good
    parts = rows @ axes.T
    low, high = parts.quantile(0.01, 0), parts.quantile(0.99, 0)
    scaled = ((parts - low) / (high - low).clamp_min(1e-12)).clamp(0, 1)
    scaled = torch.cat([scaled, scaled[:, -1:].expand(-1, 3 - rank)], 1)
    return (255 * scaled).round().to(torch.uint8).view(*plane.shape[:2], 3).numpy()
