"""The stages that turn a surface into a fitted BTF: captures in shards, truths, fits."""

import logging
import time

import pandas as pd
import torch

from neumat.btf.capture import share, write_pictures, write_queries
from neumat.btf.pairs import given_pairs, grid_pairs, held_out_pairs
from neumat.btf.representations.registry import make
from neumat.btf.store import read_btf
from neumat.btf.surfaces.surface import Surface
from neumat.files import atomic_path

RELIEF = ("quads", "bounces")  # settings of the gonioreflectometer


def capture_pairs(capture, settings, seed):
    """Return light and view, each (n, 3), of the pictures of a capture, "grid" or "held-out".

    Held-out pairs are those for validation, those for the report, each group drawn by itself, and those of figures.
    """
    if capture == "grid":
        return grid_pairs(settings["theta"], settings["count"])
    groups = [held_out_pairs(settings[name], seed, name) for name in ("validation", "report")]
    groups.append(given_pairs(settings["shown"]))
    return tuple(torch.cat(directions) for directions in zip(*groups, strict=True))


def capture_shard(surface, capture, settings, shard, shards, seed, path, progress=iter, stores=None):
    """Capture shard number `shard`, from 1, of `shards` of a capture of a surface into the store `path`.

    surface: its config; capture: "queries", "grid" or "held-out"; settings: of the config's section `btf.<capture>`,
    with texels, quads and bounces; stores: {material: path of the store that has its field}.
    """
    surface, options = Surface(surface), {name: settings[name] for name in RELIEF} | {"stores": stores}
    texels, samples = settings["texels"], settings["samples"]
    if capture == "queries":
        part = share(settings["sweeps"], shard - 1, shards)
        write_queries(path, surface, texels, part, settings["pairs"], samples, seed, progress, **options)
        return
    light, view = capture_pairs(capture, settings, seed)
    part = share(len(light), shard - 1, shards)
    light, view = (directions[part.start : part.stop] for directions in (light, view))
    write_pictures(path, surface, texels, light, view, samples, seed, progress=progress, **options)


def capture_truth(surface, settings, extent, seed, path, progress=iter, stores=None):
    """Capture pictures of a surface without period over `extent` exemplars along a side.

    surface: its config; settings: pairs (rows of four angles, degrees), samples, texels, quads and bounces; stores: as
    in `capture_shard`.
    """
    light, view = given_pairs(settings["pairs"])
    options = {name: settings[name] for name in RELIEF} | {"stores": stores}
    surface = Surface(surface).infinite()
    texels, samples = settings["texels"], settings["samples"]
    write_pictures(path, surface, texels, light, view, samples, seed, extent, progress, **options)


def fit_representation(store_path, name, hyperparameters, seed, path, cost_path, progress=iter):
    """Fit a representation to a store and save it; write what it took as a table of one row.

    name: in the registry; what follows an @ says how it differs, and is for the table.
    """
    model = make(name.partition("@")[0], hyperparameters)
    start = time.process_time()
    model.fit(read_btf(store_path), seed, progress)
    cost = pd.DataFrame([{"representation": name, "bytes": model.bytes, "fit_s": time.process_time() - start}])
    logging.info("%s: %d bytes, %.1f s of CPU time", *cost.iloc[0])
    model.save(path)
    with atomic_path(cost_path) as temporary:
        cost.to_csv(temporary, index=False)
