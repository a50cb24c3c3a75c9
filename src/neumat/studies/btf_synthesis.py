"""How near what is synthesised from a fitted exemplar comes to a larger patch of the true surface."""

import logging
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
from neumat.metrics.seams import compare_seams
from neumat.metrics.textures import STATISTICS, Truth, describe
from neumat.render.scene import to_srgb8
from neumat.seeds import torch_generator

SIDE = 2  # exemplars along a side of the pictures that are compared
PLACES = ((0.31, 0.77), (-41.83, 1003.29))  # their first corners: the exemplar's border crosses them
QUERIES = 1 << 18
ALL = (*STATISTICS, "seams")
BLOCKS = 4  # of the control "hard", along a side of the exemplar
NEAR = ("histogram", "colours", "spectrum", "autocovariance", "ghosts", "coverage")  # one exemplar's own statistics
# Pictures of known faults, and the statistics that are taken of them: the ceiling, the exemplar decoded as it is; its
# texels in random order; random blocks of it side by side.
CONTROLS = {"exemplar": NEAR, "shuffled": NEAR, "hard": ("seams",)}


def synthesis_table(paths, queries_path, truth_path, methods, default, seed, progress=iter):
    """Return a row for each method and part of the truth, "choice" and "report", of one surface.

    paths: {representation: path of its fit}. Of the first every method and CONTROLS are compared, of the others
    "exemplar" and the method `default`. truth_path: None where there is no truth beyond the exemplar; then `part` is
    "not measured", and rows tell what methods cost.

    Each statistic of `metrics.textures` has two columns: its ratio to that of the truth's own crops against each other
    (1 is perfect), and `<name>_scatters`, by how many standard deviations over the crops it lies beyond them. All are
    means over the truth's pairs of directions and over PLACES. `copies` is the share itself, since the truth has none;
    `seams` are looked for where the exemplar's borders would lie, of the control "hard" where its blocks meet; `crops`
    counts those of all pairs. Cost: fetches, bytes, bytes_ratio (to the exemplar's plane), ns of a query,
    first_s: seconds until the first query is answered; dynamic or stored.
    """
    models = {name: load_representation(path) for name, path in paths.items()}
    queries, (first, *_) = read_btf(queries_path), models
    size, brightness = models[first].size[0], exposure(queries)
    if truth_path is None:
        logging.warning("nothing was measured beyond the exemplar: synthesis is compared with nothing")
        truth, parts = None, {"not measured": []}
    else:
        truth = read_btf(truth_path)
        parts = dict(zip(("choice", "report"), zip(*split_crops(truth, brightness), strict=True), strict=True))
        parts = {name: [(Truth(crops, size), crops) for crops in each] for name, each in parts.items()}
    controls = CONTROLS if truth else {}
    tasks = [(first, method) for method in (*controls, *methods)]
    tasks += [(name, method) for name in [*models][1:] for method in (*list(controls)[:1], default)]
    rows = []
    for name, method in progress(tasks):
        model, cost = models[name], {}
        if method in controls:
            makes, places, names = _control(model, method, seed), [((0, 0), BLOCKS)], CONTROLS[method]
        else:
            synthesis, cost = timed(method, model.positional(), seed, queries.tileable)
            makes, places, names = EndlessBtf(model, synthesis).picture, [(place, 1) for place in PLACES], ALL
        seen = _seen(makes, truth, places, brightness, size, names) if truth else []
        for part, truths in parts.items():
            sizes = {"texels": size, "crops": sum(each.count for each, _ in truths)}
            about = {"representation": name, "method": method, "part": part}
            rows.append(about | sizes | (_ratios(seen, truths) if truths else {}) | cost)
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


def _seen(makes, truth, places, brightness, size, names):
    """Return [[(picture, its borders or None, what `describe` sees of it) at each of `places`] for each pair of the
    truth].

    makes: (light, view (3,), place, extent) -> the picture, 1/sr; places: [(first corner, blocks along a side of an
    exemplar)]; size: texels along a side of the exemplar; names: of statistics.
    """
    seen = []
    for light, view in zip(truth.light[:, 0], truth.view[:, 0], strict=True):
        seen.append([])
        for place, blocks in places:
            picture = shown(makes(light, view, place, SIDE), brightness)
            borders = _borders(place, size, blocks) if "seams" in names else None
            seen[-1].append((picture, borders, describe(picture, size, [name for name in names if name != "seams"])))
    return seen


def _borders(place, size, blocks):
    """Return pixel columns, and rows, left of and above which blocks meet, `blocks` along a side of an exemplar of
    `size` texels, in a picture that begins at `place`: two for each border, which may lie between pixels' centres."""
    borders = []
    for first in place:
        step = size / blocks
        at = torch.arange(1, SIDE * blocks + 1) * step - first % 1 * size
        at = at[(at > 1) & (at < SIDE * size - 1)].floor().long()
        borders.append(torch.cat([at, at + 1]) if first % 1 else at)
    return borders


def _control(model, name, seed):
    """Return a function as `EndlessBtf.picture`, of the control `name`, made of the exemplar's picture."""

    def makes(light, view, place, extent):
        picture = model.picture(light, view)
        height, width = picture.shape[:2]
        generator = torch_generator(seed, name)
        if name == "shuffled":
            picture = picture.flatten(0, 1)[torch.randperm(height * width, generator=generator)].view_as(picture)
        if name != "hard":
            return picture.repeat(extent, extent, 1)
        sides = height // BLOCKS, width // BLOCKS
        blocks = picture.unfold(0, sides[0], 1).unfold(1, sides[1], 1)
        count = extent * BLOCKS
        i, j = (torch.randint(0, n, (count, count), generator=generator) for n in blocks.shape[:2])
        return blocks[i, j].permute(0, 3, 1, 4, 2).flatten(2, 3).flatten(0, 1)

    return makes


def _ratios(seen, truths):
    """Return {statistic: ratio, statistic_scatters: deviations}, means over pictures and places."""
    found = []
    for places, (truth, crops) in zip(seen, truths, strict=True):
        for picture, borders, described in places:
            found.append(truth.ratios(described))
            if borders:
                found[-1]["seams"] = compare_seams(picture, crops, *borders)
    names = found[0]
    row = {name: np.mean([ratios[name].ratio for ratios in found]) for name in names}
    if "copies" in row:  # the truth has none
        row["copies"] = np.mean([ratios["copies"].value for ratios in found])
    return row | {f"{name}_scatters": np.mean([_scatters(ratios[name]) for ratios in found]) for name in names}


def _scatters(ratio):
    """Return by how many standard deviations over crops a statistic exceeds the truth's own."""
    return (ratio.value - ratio.truth) / ratio.scatter if ratio.scatter > 1e-9 else np.nan
