"""Figures of BTFs: what a fit learns and how near it comes, and how far an exemplar can be stretched."""

import torch

from neumat.btf.endless import endless
from neumat.btf.exposure import exposure
from neumat.btf.representations.registry import load_representation
from neumat.btf.store import read_btf
from neumat.metrics.shown import shown_errors
from neumat.render.scene import to_srgb8
from neumat.reporting.btf_sheets import error_map, false_colours, picture_grid

PIXELS = 512  # along a side of a picture of more than one exemplar
PLACE = (0.31, 0.77)  # where synthesised pictures begin
ENLARGEMENTS = (1, 5, 15, 45)


def planes_figure(model, path):
    """Write the planes of a fitted triple plane, their principal components as colours (the paper's Fig. 2), as PNG."""
    planes = [model.positional(), *model.directional()]
    names = ["position", "half vector", "difference vector"]
    picture_grid(["features"], names, [[false_colours(plane) for plane in planes]], path)


def fits_figure(models, pictures, count, brightness, path):
    """Write the last `count` of `pictures`, a BtfStore, and each of {name: model} with its FLIP map, as PNG.

    Below each stand DSSIM and FLIP (the paper's Figs. 4, 5 and 8).
    """
    rows, captions = [], []
    for k in range(pictures.sweeps - count, pictures.sweeps):
        truth = pictures.values([k]).float()
        shown = to_srgb8(truth, brightness)[0].numpy()
        found = [model.picture(pictures.light[k, 0], pictures.view[k, 0]) for model in models.values()]
        errors = [shown_errors(truth, each[None], brightness) for each in found]
        found = [to_srgb8(each, brightness).numpy() for each in found]
        rows += [[shown, *found], [None, *(error_map(shown, each) for each in found)]]
        captions += [
            ["", *(f"DSSIM {e['dssim'][0]:.3f}, FLIP {e['flip'][0]:.3f}" for e in errors)],
            [""] * len(rows[0]),
        ]
    names = [name for k in range(count) for name in (f"pair {k + 1}", "FLIP")]
    picture_grid(names, ["captured", *models], rows, path, captions)


def synthesis_figure(model, methods, pairs, tileable, extent, brightness, seed, path, truth=None):
    """Write exemplar, truth and what each method makes of the exemplar over `extent` exemplars (the paper's Fig. 7), as
    PNG. pairs: light and view, each (n, 3); truth: BtfStore of pictures at them, at least as large, of which the first
    part is shown, or None."""
    syntheses = {name: endless(model, name, seed, tileable) for name in methods}
    rows = []
    for k, (light, view) in enumerate(zip(*pairs, strict=True)):
        pictures = [model.picture(light, view)]
        if truth:
            part = round(truth.height * extent / truth.extent)
            pictures.append(_reduced(truth.values([k])[0, :part, :part].float()))
        pictures += [each.picture(light, view, PLACE, extent, _pixels(model, extent)) for each in syntheses.values()]
        rows.append([to_srgb8(picture, brightness).numpy() for picture in pictures])
    names = [f"pair {k + 1}" for k in range(len(rows))]
    columns = ["exemplar", *(["captured"] if truth else []), *methods]
    picture_grid(names, columns, rows, path, title=f"{extent} x {extent} exemplars", enlarged=1.6)


def enlargements_figure(model, method, pairs, tileable, brightness, seed, path):
    """Write what `method` makes of a fitted exemplar over 1 to 45 exemplars, by levels of detail (the paper's Fig. 6),
    as PNG. pairs: light and view, each (n, 3)."""
    synthesised = endless(model, method, seed, tileable)
    rows = [
        [
            to_srgb8(synthesised.picture(*pair, PLACE, extent, _pixels(model, extent)), brightness).numpy()
            for extent in ENLARGEMENTS
        ]
        for pair in zip(*pairs, strict=True)
    ]
    names = [f"pair {k + 1}" for k in range(len(rows))]
    picture_grid(
        names, [f"{extent} x" for extent in ENLARGEMENTS], rows, path, title=f"{method}, with levels of detail"
    )


def tiled_and_synthesised_figure(models, method, pairs, tileable, brightness, seed, extent, path):
    """Write {name: model} tiled, and synthesised by `method`, over `extent` exemplars (the paper's Fig. 9), as PNG."""
    light, view = pairs
    columns = [(model, name) for name in ("tiling", method) for model in models]
    syntheses = {(model, name): endless(models[model], name, seed, tileable) for model, name in columns}
    rows = [
        [to_srgb8(syntheses[column].picture(*pair, PLACE, extent, PIXELS), brightness).numpy() for column in columns]
        for pair in zip(light, view, strict=True)
    ]
    names = [f"pair {k + 1}" for k in range(len(rows))]
    picture_grid(names, [f"{model}, {name}" for model, name in columns], rows, path)


def load_fitted(paths, queries_path):
    """Return ([model in each file], the exposure of the surface that they were fitted to)."""
    return [load_representation(path) for path in paths], exposure(read_btf(queries_path))


def _pixels(model, extent):
    """Return how many pixels show `extent` exemplars: one a texel, PIXELS at most."""
    return min(PIXELS, extent * model.size[0])


def _reduced(picture):
    """Return a picture (H, W, 3) averaged over blocks of pixels, to PIXELS a side or a little more."""
    factor = max(1, picture.shape[0] // PIXELS)
    side = picture.shape[0] // factor * factor
    return torch.nn.functional.avg_pool2d(picture[:side, :side].permute(2, 0, 1), factor).permute(1, 2, 0)
