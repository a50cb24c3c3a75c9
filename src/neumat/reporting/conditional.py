"""M3ashy's Figs. 6 to 9: materials of each category, and from the samples of an evaluation."""

import numpy as np

from neumat.render.mitsuba_scene import render_grid
from neumat.reporting.request_figures import empty_page, request_sheet

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

    requests: a `studies.request_bench.Requests`; weights (r n, 675): the samples of each in turn.
    """
    wanted = FIGURES[requests.modality]
    chosen = [i for i, name in enumerate(requests.names) if wanted is None or name in wanted]
    chosen = chosen[:IMAGES] if wanted is None else chosen or list(range(min(2, len(requests))))
    each = weights.view(len(requests), -1, weights.shape[1])[chosen, :PER_REQUEST]
    pictures = _pictures(each.flatten(0, 1), each.shape[1], size, spp)
    shown = None if requests.shown is None else [np.asarray(requests.shown[i]) for i in chosen]
    request_sheet([requests.names[i] for i in chosen], pictures, path, shown)


def write_figures(samples, size, spp, paths):
    """Write the figures {modality: path} of `samples`, a list of (Requests, weights), the first ones of each modality,
    see `request_figure`; of a modality that nothing was asked by, a page that says so."""
    for modality, path in paths.items():
        asked = next((both for both in samples if both[0].modality == modality), None)
        if asked:
            request_figure(*asked, size, spp, path)
        else:
            empty_page(f"Not measured: no {modality} is known of these materials.", path)


def category_figure(found, size, spp, path):
    """Write the first PER_REQUEST materials of each category, {category: weights (k, 675)}, as PNG; where there are
    fewer, the rest of the row stays empty."""
    pictures = np.full((len(found), PER_REQUEST, size, size, 3), 255, np.uint8)
    for row, weights in zip(pictures, found.values(), strict=True):
        first = weights[:PER_REQUEST]
        if len(first):
            row[: len(first)] = _pictures(first, len(first), size, spp)[0]
    request_sheet(list(found), pictures, path)


def _pictures(weights, columns, size, spp):
    """Return pictures uint8 (rows, columns, size, size, 3) of fields (rows columns, 675)."""
    sheet = render_grid(weights, columns, size, spp)
    return sheet.reshape(-1, size, columns, size, 3).swapaxes(1, 2)
