"""What a query of a BTF costs: plain PyTorch, and Dr.Jit as pictures evaluate it, in one run.

Plain PyTorch fetches features by `grid_sample`, takes layers as `linear`, and works in batches of BATCH, without
synthesis. Dr.Jit evaluates all queries in one kernel.
"""

import time

import pandas as pd
import torch
from torch.nn.functional import grid_sample, linear

from neumat.btf.directions import random_pairs
from neumat.btf.endless import endless
from neumat.btf.representations.encoding import Encoding
from neumat.render.mitsuba_scene import mitsuba
from neumat.seeds import torch_generator

BATCH = 65_536
EXTENT = 10.0  # exemplars along a side of the square of positions
ROUNDS = 3  # of which the quickest counts
COLUMNS = ["engine", "synthesis", "precision", "queries", "first_seconds", "cpu_seconds", "wall_seconds", "ns", "share"]


def plain_torch(representation):
    """Return a function of positions u (n, 2) in [0, 1), lights and views (n, 3) -> values (n, 3) of a `Neural`
    representation."""
    plane = representation.positional().permute(2, 0, 1)[None]
    directional = [each.permute(2, 0, 1)[None] for each in representation.directional()]
    layers = representation.layers()
    encoding = Encoding(*representation.state["encoding"].tolist())

    def fetched(plane, position, outermost_on_border):
        grid = (2 * position - 1)[None, None]
        return grid_sample(plane, grid, padding_mode="border", align_corners=outermost_on_border)[0, :, 0].T

    def values(u, light, view):
        positions, extras = representation.parametrise(light, view)
        features = [fetched(each, place, True) for each, place in zip(directional, positions, strict=True)]
        x = torch.cat([fetched(plane, u, False), *features, extras.T], 1)
        for layer in layers[:-1]:
            x = linear(x, layer).relu()
        return encoding.decode(linear(x, layers[-1]))

    @torch.no_grad()
    def evaluate(u, light, view):
        parts = zip(u.split(BATCH), light.split(BATCH), view.split(BATCH), strict=True)
        return torch.cat([values(*part) for part in parts])

    return evaluate


def compiled(btf, half=False):
    """Return a function of a Point2d and two Vector3f -> Color3f that evaluates an EndlessBtf in Dr.Jit."""
    from neumat.btf.compiled.decoder import Decoder
    from neumat.btf.compiled.registry import endless_plane

    plane, decoder = endless_plane(btf.synthesis), Decoder(btf.representation, half)
    return lambda u, light, view: decoder.value(plane.at(u), light, view)


def query_bench(representation, methods, counts, seed, progress=iter):
    """Return a DataFrame of COLUMNS with a row for each engine, synthesis method ("none": the exemplar as it is) and
    precision of the network, at each of `counts` random queries.

    first_seconds: CPU time of the first call, in which a kernel is compiled. share: of the CPU time of plain PyTorch
    without synthesis at that count. Dr.Jit and PyTorch have as many threads as the run gives them.
    """
    mi = mitsuba()
    import drjit as dr

    def in_drjit(function):
        def call(u, light, view):
            value = function(mi.Point2d(u.T.numpy()), mi.Vector3f(light.T.numpy()), mi.Vector3f(view.T.numpy()))
            dr.eval(value)
            dr.sync_thread()

        return call

    def on(method):
        return endless(representation, method, seed, False)

    naive = plain_torch(representation)
    kinds = [
        ("pytorch", "none", "fp32", lambda u, *pair: naive((u % 1).float(), *pair)),
        ("drjit", "none", "fp32", in_drjit(compiled(on("tiling")))),
        ("drjit", "none", "fp16", in_drjit(compiled(on("tiling"), half=True))),
        *(("drjit", method, "fp32", in_drjit(compiled(on(method)))) for method in methods if method != "tiling"),
    ]
    rows = []
    for count in progress(counts):
        generator = torch_generator(seed, "queries", count)
        u = torch.rand(count, 2, generator=generator, dtype=torch.float64) * EXTENT
        pair = random_pairs(count, generator)
        plain = None
        for engine, method, precision, call in kinds:
            spent = [_seconds(call, u, *pair) for _ in range(1 + ROUNDS)]
            cpu, wall = min(spent[1:])
            plain = cpu if plain is None else plain
            rows.append([engine, method, precision, count, spent[0][0], cpu, wall, 1e9 * cpu / count, cpu / plain])
    return pd.DataFrame(rows, columns=COLUMNS)


def _seconds(call, *arguments):
    cpu, wall = time.process_time(), time.perf_counter()
    call(*arguments)
    return time.process_time() - cpu, time.perf_counter() - wall
