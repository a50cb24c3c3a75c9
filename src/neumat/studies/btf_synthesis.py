"""How near what is synthesised from a fitted exemplar comes to a larger patch of the true surface."""

import time

import numpy as np
import pandas as pd
import torch

from neumat.btf.endless import EndlessBtf
from neumat.btf.exposure import exposure
from neumat.btf.representations.registry import load_representation
from neumat.btf.store import read_btf
from neumat.btf.synthesis import SYNTHESES
from neumat.errors import NeumatError
from neumat.metrics.textures import STATISTICS, Truth
from neumat.render.scene import to_srgb8
from neumat.seeds import torch_generator

SIDE = 2  # exemplars along a side of the pictures that are compared
PLACES = ((0.31, 0.77), (-41.83, 1003.29))  # their first corners: the exemplar's border crosses them
QUERIES = 1 << 18
NEAR = ("histogram", "colours", "spectrum", "autocovariance", "ghosts", "coverage")  # one exemplar's own statistics


def synthesis_table(model_path, queries_path, truth_path, methods, seed, progress=iter):
    """Return a row for each method and part of the truth, "choice" and "report", of one surface.

    Each statistic of `metrics.textures` has two columns: its ratio to that of the truth's own crops against each other
    (1 is perfect), and `<name>_scatters`, by how many standard deviations over the crops it lies beyond them. All are
    means over the truth's pairs of directions and over PLACES. `copies` is the share itself, since the truth has none;
    `crops` counts those of all pairs. Cost: fetches, bytes, bytes_ratio (to the exemplar's plane), ns of a query,
    first_s: seconds until the first query is answered; dynamic or stored. Beside the methods: "exemplar", the ceiling,
    the exemplar decoded as it is; "shuffled", its texels in random order.
    """
    model, brightness = load_representation(model_path), exposure(read_btf(queries_path))
    truth = read_btf(truth_path)
    parts = dict(zip(("choice", "report"), zip(*split_crops(truth, brightness), strict=True), strict=True))
    parts = {name: [Truth(crops, model.size[0]) for crops in each] for name, each in parts.items()}
    rows = []
    for method in progress(["exemplar", "shuffled", *methods]):
        cost, pictures = {}, _controls(model, truth, brightness, method, seed)
        if method in methods:
            synthesis, cost = timed(method, model.positional(), seed, truth.tileable)
            pictures = _synthesised(EndlessBtf(model, synthesis), truth, brightness)
        names = list(STATISTICS) if method in methods else NEAR
        for part, truths in parts.items():
            sizes = {"texels": model.size[0], "crops": len(truths) * truths[0].count}
            rows.append({"method": method, "part": part} | sizes | _ratios(pictures, truths, names) | cost)
    return pd.DataFrame(rows)


def shown(values, brightness):
    """Return linear values as sRGB numbers 0..1, float32, rounded to 8 bits as a display shows them."""
    return to_srgb8(values.float(), brightness).float() / 255


def split_crops(truth, brightness):
    """Return ([crops for the choice], [crops for the report]) of each picture of a truth, as sRGB.

    Crops are SIDE exemplars wide. The first row of them is for choosing between methods, the others for the report.
    Raises NeumatError for a truth with fewer than two crops on either side.
    """
    size = round(SIDE * truth.height / truth.extent)
    if truth.height < 2 * size:
        raise NeumatError("truth", f"at least {2 * SIDE} exemplars along a side", f"{truth.extent:g}")
    groups = []
    for k in range(truth.sweeps):
        picture = shown(truth.values([k])[0], brightness)
        rows = [[crop for crop in row.split(size, 1) if crop.shape[1] == size] for row in picture.split(size)]
        rows = [row for row in rows if row[0].shape[0] == size]
        groups.append((rows[0], [crop for row in rows[1:] for crop in row]))
    return groups


def timed(method, plane, seed, tileable):
    """Return (the Synthesis of a plane (H, W, c) by `method`, {what it costs}); raises NeumatError for no method."""
    if method not in SYNTHESES:
        raise NeumatError("synthesis method", f"one of {', '.join(SYNTHESES)}", method)
    start = time.thread_time()
    synthesis = SYNTHESES[method](plane, seed, tileable)
    u = torch.rand(QUERIES, 2, generator=torch_generator(seed, "positions"), dtype=torch.float64) * 100
    synthesis.at(u[:1])
    first = time.thread_time() - start
    start = time.thread_time()
    synthesis.at(u)
    return synthesis, {
        "dynamic": synthesis.dynamic,
        "fetches": synthesis.fetches,
        "bytes": synthesis.bytes,
        "bytes_ratio": synthesis.bytes / (4 * plane.numel()),
        "ns": 1e9 * (time.thread_time() - start) / QUERIES,
        "first_s": first,
    }


def _synthesised(endless, truth, brightness):
    """Return [[picture at each of PLACES] for each picture of the truth], as sRGB."""
    return [
        [shown(endless.picture(light[0], view[0], place, SIDE), brightness) for place in PLACES]
        for light, view in zip(truth.light, truth.view, strict=True)
    ]


def _controls(model, truth, brightness, name, seed):
    """Return pictures as `_synthesised` does, of the exemplar beside itself, its texels shuffled where asked for."""
    pictures = []
    for light, view in zip(truth.light, truth.view, strict=True):
        picture = shown(model.picture(light[0], view[0]), brightness)
        if name == "shuffled":
            order = torch.randperm(picture.shape[0] * picture.shape[1], generator=torch_generator(seed, "shuffled"))
            picture = picture.flatten(0, 1)[order].view_as(picture)
        pictures.append([picture.repeat(SIDE, SIDE, 1)])
    return pictures


def _ratios(pictures, truths, names):
    """Return {statistic: ratio, statistic_scatters: deviations}, means over pictures and places."""
    pairs = zip(pictures, truths, strict=True)
    found = [truth.compare(picture, names) for places, truth in pairs for picture in places]
    row = {name: np.mean([ratios[name].ratio for ratios in found]) for name in names}
    if "copies" in row:  # the truth has none
        row["copies"] = np.mean([ratios["copies"].value for ratios in found])
    return row | {f"{name}_scatters": np.mean([_scatters(ratios[name]) for ratios in found]) for name in names}


def _scatters(ratio):
    """Return by how many standard deviations over crops a statistic exceeds the truth's own."""
    return (ratio.value - ratio.truth) / ratio.scatter if ratio.scatter > 1e-9 else np.nan
