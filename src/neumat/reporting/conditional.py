"""M3ashy's Figs. 7 to 9 from the samples of an evaluation."""

import numpy as np

from neumat.render.mitsuba_scene import render_grid
from neumat.reporting.request_figures import request_sheet

# What the figures show, where it was asked for; images: the first ones.
FIGURES = {
    "type": ("metallic-paint", "fabric", "specular-phenolic", "chrome", "rubber", "paint", "acrylic", "wood"),
    "text": (
        "green metal", "red plastic", "highly specular material", "blue silk",
        "matte pink chalk", "polished copper", "green metallic car paint", "white porcelain cup",
    ),
    "image": None,
}  # fmt: skip
IMAGES, PER_REQUEST = 8, 5


def request_figure(requests, weights, size, spp, path):
    """Write the figure of one modality as PNG, rendered by Mitsuba.

    requests: a `conditions.evaluate.Requests`; weights (r n, 675): the samples of each in turn.
    """
    wanted = FIGURES[requests.modality]
    chosen = [i for i, name in enumerate(requests.names) if wanted is None or name in wanted]
    chosen = chosen[:IMAGES] if wanted is None else chosen or list(range(min(2, len(requests))))
    each = weights.view(len(requests), -1, weights.shape[1])[chosen, :PER_REQUEST]
    n = each.shape[1]
    sheet = render_grid(each.flatten(0, 1), n, size, spp)
    pictures = sheet.reshape(len(chosen), size, n, size, 3).swapaxes(1, 2)
    shown = None if requests.shown is None else [np.asarray(requests.shown[i]) for i in chosen]
    request_sheet([requests.names[i] for i in chosen], pictures, path, shown)
