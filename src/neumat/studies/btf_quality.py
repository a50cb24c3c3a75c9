"""How near the pictures of a fitted BTF come to captured ones at directions that it has not seen, and what it costs."""

import itertools
import time

import numpy as np
import pandas as pd
import torch

from neumat.btf.directions import random_pairs
from neumat.btf.endless import pixel_centres
from neumat.btf.exposure import exposure
from neumat.btf.planes import fetch
from neumat.btf.representations.registry import load_representation
from neumat.btf.store import read_btf
from neumat.metrics.shown import shown_errors
from neumat.seeds import torch_generator

RINGS = (0, 25, 50, 75)  # degrees: tables have columns for the views' polar angles between them
QUERIES = 1 << 18
REPEATS = 3  # of the time of a query, of which the least counts


def quality(model_path, queries_path, held_out_path, counts, seed):
    """Return a row for each part of the held-out pairs: errors of a representation's pictures there.

    counts: {part: how many pairs}, in the order of the store: settings are chosen on those of "validation".

    Columns: psnr (dB), dssim and flip of
    sRGB pictures at the surface's exposure, means, worsts and means by ring of the view's angle; texels along a
    side of the pictures; ns of a query.
    """
    model, held_out = load_representation(model_path), read_btf(held_out_path)
    errors = pair_errors(model, held_out, exposure(read_btf(queries_path)))
    ends = np.cumsum(list(counts.values()))
    parts = {name: errors[end - count : end] for (name, count), end in zip(counts.items(), ends, strict=True)}
    rows = pd.DataFrame([{"pairs": name, "pictures": len(part), **summary(part)} for name, part in parts.items()])
    return rows.assign(texels=held_out.height, ns=query_ns(model, seed))


def pair_errors(model, pictures, brightness):
    """Return a row for each pair of directions of `pictures`, a BtfStore: theta_view (degrees), psnr, dssim and flip.

    brightness: the exposure that pictures are shown at.
    """
    rows = []
    for k in range(pictures.sweeps):
        light, view = pictures.light[k, 0], pictures.view[k, 0]
        found = shown_errors(pictures.values([k]), picture_at(model, light, view, pictures.height)[None], brightness)
        theta = np.degrees(np.arccos(view[2].item()))
        rows.append({"theta_view": theta, **{name: value[0] for name, value in found.items()}})
    return pd.DataFrame(rows)


def picture_at(model, light, view, pixels):
    """Return a model's picture (pixels, pixels, 3) of the exemplar, its features interpolated between texels."""
    if model.size == (pixels, pixels):
        return model.picture(light, view)
    features = fetch(model.positional(), pixel_centres((0, 0), 1, pixels), wrap=False)
    return model.eval(features, light[None], view[None]).view(pixels, pixels, 3)


def summary(errors):
    """Return one row of a table of `pair_errors`: means, worsts, and means by ring of the view's angle."""
    row = {name: errors[name].mean() for name in ("psnr", "dssim", "flip")}
    row |= {"psnr_worst": errors["psnr"].min()}
    row |= {f"{name}_worst": errors[name].max() for name in ("dssim", "flip")}
    for least, most in itertools.pairwise(RINGS):
        ring = errors[errors["theta_view"].between(least, most, inclusive="left")]
        row |= {f"{name}_{least}_{most}": ring[name].mean() for name in ("psnr", "flip")}
    return row


def query_ns(model, seed):
    """Return the time, ns of one core, of a query at a random position and a random pair of directions."""
    generator = torch_generator(seed, "queries")
    u = torch.rand(QUERIES, 2, generator=generator, dtype=torch.float64)
    light, view = random_pairs(QUERIES, generator)
    plane, taken = model.positional(), []
    for _ in range(REPEATS):
        start = time.thread_time()
        model.eval(fetch(plane, u, wrap=False), light, view)
        taken.append(time.thread_time() - start)
    return 1e9 * min(taken) / QUERIES
