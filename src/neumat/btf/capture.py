"""The capture of a surface by a virtual gonioreflectometer: random queries, and pictures at pairs of directions.

Values are reflectance times the cosine of the light, 1/sr, at positions on the plane of mean height; see `btf.store`.
Every sweep has random numbers of its own, derived from the seed and its number, every picture from the seed and its
directions: neither depends on what is captured with it, so shards may be cut anywhere.
"""

import logging
import math

import torch

from neumat.btf.directions import LARGEST, random_pairs
from neumat.btf.facets import facet_material
from neumat.btf.gonioreflectometer import Facets, Gonioreflectometer
from neumat.btf.relief import height_range, relief
from neumat.btf.store import attributes, read_btf, write_btf
from neumat.errors import NeumatError
from neumat.seeds import seed_for, torch_generator

PATHS = 1 << 20  # traced at a time
PART = 512  # texels, at most, along a side of a part of a picture
LARGEST_LIGHT = math.radians(75)  # up to which the shadows in all of a picture are true
LARGEST_MARGIN = 1.0  # sides of the exemplar


def query_directions(sweeps, pairs, seed, largest=LARGEST):
    """Return light and view, each (s, pairs, 3), of the sweeps of random queries whose numbers are `sweeps`.

    Each is drawn by `directions.random_directions`, even over the disk of radius theta up to `largest`, radians.
    """
    light, view = torch.empty(2, len(sweeps), pairs, 3)
    for k, sweep in enumerate(sweeps):
        light[k], view[k] = random_pairs(pairs, torch_generator(seed, "directions", sweep), largest)
    return light, view


def capture_queries(surface, texels, sweeps, light, view, samples, seed, progress=iter, **options):
    """Yield blocks (sweep, row, column, values (k, texels, texels, 3)) of random queries, for `store.write_btf`.

    surface: `btf.surfaces.surface.Surface`; texels: along a side of the exemplar; sweeps: a range of numbers, of which
    the first is sweep 0 of the blocks; light, view: those of `query_directions`; samples: paths a value; options: those
    of `_captured`.
    """
    keys = [_key(seed, "sweep", sweep) for sweep in sweeps]
    exemplar = [(range(texels), range(texels))]
    yield from _captured(surface, texels, texels, exemplar, light, view, keys, samples, progress, **options)


def capture_pictures(surface, texels, light, view, samples, seed, extent=1, progress=iter, **options):
    """Yield blocks (picture, row, column, values (k, h, w, 3)) of pictures at pairs of directions, for `write_btf`.

    light, view: (s, 3); extent: exemplars along a side of the pictures, (extent texels)^2 in size: for more than 1 of a
    tileable surface give its `infinite()`. The rest as in `capture_queries`. Pictures are captured in square parts, all
    pictures of one part after the other, so that memory doesn't grow with the extent.
    """
    keys = [_key(seed, "picture", *pair) for pair in torch.cat([light, view], 1).tolist()]
    size = round(texels * extent)
    cuts = [range(first, min(first + PART, size)) for first in range(0, size, PART)]
    parts = [(rows, columns) for rows in cuts for columns in cuts]
    light, view = light[:, None], view[:, None]
    yield from _captured(surface, texels, size, parts, light, view, keys, samples, progress, **options)


def _key(seed, *names):
    return seed_for(seed, *names) & 0xFFFFFFFF


def _captured(surface, texels, width, parts, light, view, keys, samples, progress, quads=2, bounces=3, stores=None):
    """Yield blocks of the parts, [(rows, columns)], of pictures that are `width` texels wide.

    light, view: (s, p, 3); keys: s integers; quads: of the relief, to a side of a texel; bounces: facets that a path
    meets, 3 for direct and twice reflected light; stores: {material: path of the store that has its field}, for those
    that are neither embedded nor files.
    """
    facets = Facets([facet_material(name, (stores or {}).get(name)) for name in surface.materials])
    margin = _margin(surface)
    tasks = []
    for rows, columns in parts:
        at_once = max(1, PATHS // (len(rows) * len(columns) * samples))
        tasks += [((rows, columns), slice(k, k + at_once)) for k in range(0, len(keys), at_once)]
    held, lost, traced = None, 0, 0
    for part, group in progress(tasks):
        if held != part:
            held, instrument = part, None  # frees the last one's memory before the next one is made
            shape = relief(surface, texels, *part, margin, quads)
            instrument = Gonioreflectometer(shape, facets, *part, width, texels, bounces)
        values, missed = instrument.values(light[group], view[group], keys[group], samples)
        lost, traced = lost + missed, traced + samples * values[..., 0].numel()
        yield group.start, part[0].start, part[1].start, values
    logging.info("%d paths, of which %d left the relief without meeting it", traced, lost)


def _margin(surface):
    """Return the width of relief around what is captured, in sides of the exemplar.

    All that is seen at up to LARGEST lies within it, and all that throws a shadow there at up to LARGEST_LIGHT.
    """
    lowest, highest = height_range(surface)
    seen = max(highest, -lowest) * math.tan(LARGEST)
    return min(max(seen, (highest - lowest) * math.tan(LARGEST_LIGHT)), LARGEST_MARGIN)


def write_queries(path, surface, texels, sweeps, pairs, samples, seed, progress=iter, **options):
    """Capture random queries into the store `path`, see `capture_queries`; `sweeps` may be a shard's share of them."""
    light, view = query_directions(sweeps, pairs, seed)
    blocks = capture_queries(surface, texels, sweeps, light, view, samples, seed, progress, **options)
    write_btf(path, light, view, texels, texels, blocks, kind="queries", **_about(surface, samples))


def write_pictures(path, surface, texels, light, view, samples, seed, extent=1, progress=iter, **options):
    """Capture pictures at pairs of directions (s, 3) into the store `path`, see `capture_pictures`."""
    size = round(texels * extent)
    blocks = capture_pictures(surface, texels, light, view, samples, seed, extent, progress, **options)
    about = _about(surface, samples) | {"kind": "pictures", "extent": size / texels}
    write_btf(path, light[:, None], view[:, None], size, size, blocks, **about)


def _about(surface, samples):
    """Return the attributes of a store that tell about the surface."""
    return {
        "size_mm": surface.size_mm,
        "tileable": surface.tileable,
        "surface": surface.config,
        "source": "captured by neumat's virtual gonioreflectometer",
        "samples": samples,
    }


def share(count, shard, shards):
    """Return the range of the numbers below `count` that shard number `shard` of `shards`, from 0, has."""
    return range(count * shard // shards, count * (shard + 1) // shards)


def gather(paths, path):
    """Write the stores `paths`, shards of one capture in order, one after the other into the store `path`.

    Raises NeumatError where they are not of the same size and kind, and of the same surface.
    """
    stores = [read_btf(shard) for shard in paths]
    first = stores[0]
    for shard, store in zip(paths, stores, strict=True):
        found, expected = ((s.height, s.width, s.pairs, attributes(s)) for s in (store, first))
        if found != expected:
            raise NeumatError(shard, f"a capture like {paths[0]}", "another size, kind or surface")
    light, view = (torch.cat([getattr(store, name) for store in stores]) for name in ("light", "view"))
    blocks = (store.values([k]) for store in stores for k in range(store.sweeps))
    write_btf(path, light, view, first.height, first.width, blocks, **attributes(first))
