"""Pictures without axes: contact sheets, and files of pictures. Matplotlib takes longer to import than they do."""

import numpy as np
from PIL import Image

from neumat.files import atomic_path


def contact_sheet(images, columns, gap=4, background=255):
    """Return pictures uint8 (n, H, W, 3) in rows of `columns`, `gap` pixels apart, as one uint8 picture."""
    images = np.asarray(images)
    n, height, width, _ = images.shape
    rows = -(-n // columns)
    cells = np.full((rows * columns, height + gap, width + gap, 3), background, np.uint8)
    cells[:n, :height, :width] = images
    sheet = cells.reshape(rows, columns, height + gap, width + gap, 3).swapaxes(1, 2)
    return sheet.reshape(rows * (height + gap), columns * (width + gap), 3)[: -gap or None, : -gap or None]


def save_image(image, path):
    """Write a uint8 picture (H, W, 3) as PNG."""
    with atomic_path(path) as temporary:
        Image.fromarray(np.asarray(image)).save(temporary)
