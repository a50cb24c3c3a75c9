"""Samples beside their nearest training materials, and heat maps of distances."""

import numpy as np

from neumat.reporting.sheets import contact_sheet
from neumat.reporting.style import figure, save_figure


def nearest_figure(sample_images, nearest_images, path, columns=6):
    """Write samples (left) beside the nearest training material of each (right, same place) as PNG; M3ashy, Fig. 11.

    sample_images, nearest_images: uint8 (n, H, W, 3).
    """
    sheets = [contact_sheet(images, columns) for images in (sample_images, nearest_images)]
    height, width, _ = sheets[0].shape
    with figure(8, 4 * height / width + 0.35, ncols=2) as (drawn, axes):
        for axis, sheet, title in zip(axes, sheets, ("Samples", "Nearest training materials"), strict=True):
            axis.imshow(sheet)
            axis.set_title(title)
            axis.axis("off")
        save_figure(drawn, path)


def heat_map(matrix, path, rows="reference", columns="samples", title="", unit=""):
    """Write a table of distances (n, m) as a PNG heat map on a logarithmic scale; M3ashy, Fig. 12.

    Rows and columns are ordered by their nearest partners, so that a matching set shows a dark diagonal; zeros and
    values that are not finite are left blank.
    """
    matrix = np.ma.masked_invalid(np.asarray(matrix, float))
    matrix = np.ma.masked_less_equal(matrix, 0)
    nearest = matrix.filled(np.inf).argmin(0)
    matrix = matrix[:, np.argsort(nearest, kind="stable")]
    with figure(5, 4.4) as (drawn, axes):
        shown = axes.imshow(matrix, norm="log", cmap="viridis", interpolation="nearest", aspect="auto")
        axes.grid(False)
        axes.set(xlabel=f"{columns}, ordered by their nearest {rows}", ylabel=rows, title=title)
        bar = drawn.colorbar(shown, ax=axes, shrink=0.9)
        bar.set_label(unit)
        bar.outline.set_visible(False)
        save_figure(drawn, path)
