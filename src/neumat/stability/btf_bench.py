"""What representations of BTFs are stressed on: captures of small surfaces, fits to them, and errors of the fits."""

import functools
import math

import torch

from neumat.btf.capture import write_pictures, write_queries
from neumat.btf.directions import random_pairs
from neumat.btf.exposure import exposure
from neumat.btf.pairs import grid_pairs
from neumat.btf.representations.registry import make
from neumat.btf.store import BtfStore, attributes, read_btf
from neumat.btf.surfaces.surface import Surface
from neumat.metrics.pictures import compare_pictures
from neumat.render.scene import to_srgb8
from neumat.seeds import torch_generator

PAIRS = 256  # of directions a sweep
PATHS = 4  # a value
HELD_OUT = 8  # pairs of directions that errors are measured at
LARGEST = math.radians(75)  # of their views and lights
CEILING = "encoded values are cut at the brightest that was fitted (`Encoding.ceiling`)"
MEAN = 64  # a mean BRDF is fitted to as many times fewer samples


class BtfBench:
    """surface: the config of a surface, as `load_surface` returns it; texels: along the side of exemplars, an even
    number; sweeps: of random queries, PATHS paths a value; samples: that a fit visits; queries: random positions or
    pairs of directions that models are asked at; folder: for files, a Path."""

    def __init__(self, surface, texels, sweeps, samples, queries, seed, folder):
        self.surface, self.texels, self.sweeps, self.samples = surface, texels, sweeps, samples
        self.queries, self.seed, self.folder = queries, seed, folder
        self._grids = {}

    def changed(self, material=None, relief=1.0):
        """Return a Surface all of one embedded material, and with `relief` times its relief."""
        config = dict(self.surface)
        if material:
            config["materials"] = [material] * len(config["materials"])
        return Surface(config).scaled(relief)

    def captured(self, surface=None, paths=PATHS, texels=None):
        """Return the BtfStore of random queries of a Surface, as many paths in all whatever `paths` a value."""
        surface, texels = surface or self.changed(), texels or self.texels
        path = self.folder / "queries.h5"
        sweeps = range(max(1, self.sweeps * PATHS // paths))
        write_queries(path, surface, texels, sweeps, min(PAIRS, texels**2), paths, self.seed)
        return held(read_btf(path))

    def pictures(self, light, view, surface=None, paths=16, texels=None):
        """Return the BtfStore of pictures of a Surface at pairs of directions (s, 3)."""
        path = self.folder / "pictures.h5"
        write_pictures(path, surface or self.changed(), texels or self.texels, light, view, paths, self.seed)
        return held(read_btf(path))

    def grid(self, count):
        """Return the BtfStore of pictures for every one of `count` views under every one of as many lights: the normal,
        and the others in a ring, and in two where they are more than 5."""
        if count not in self._grids:
            inner = (count - 1) // 2
            angles = ((0, 45), (1, count - 1)) if count <= 5 else ((0, 35, 75), (1, inner, count - 1 - inner))
            self._grids[count] = self.pictures(*grid_pairs(*angles), paths=PATHS)
        return self._grids[count]

    @functools.cached_property
    def base(self):
        """The capture of the surface as it is."""
        return self.captured()

    @functools.cached_property
    def truth(self):
        """Pictures of the surface as it is at held-out pairs of directions."""
        return self.held_out(self.changed())

    @functools.cached_property
    def ours(self):
        """The default representation of the surface as it is."""
        return self.fitted(self.base)

    def held_out(self, surface, texels=None):
        """Return the BtfStore of pictures of a Surface at the held-out pairs of directions."""
        light, view = random_pairs(HELD_OUT, torch_generator(self.seed, "held out"), LARGEST)
        return self.pictures(light, view, surface, texels=texels)

    def fitted(self, store, name="ours"):
        """Return the representation `name` fitted to a BtfStore."""
        model = make(name)
        if hasattr(model, "samples"):
            model.samples = max(1, self.samples // (MEAN if name == "mean" else 1))
        return model.fit(store, self.seed)

    def random_pairs(self, count, largest):
        """Return random light and view, each (count, 3), up to `largest`, radians."""
        return random_pairs(count, torch_generator(self.seed, "pairs"), largest)

    def brightness(self, model, truth=None, shown=False):
        """Return the mean of a model's pictures over that of those of `truth` (None: of the surface as it is); shown:
        of pictures at the exposure of the base capture in which highlights are cut to 1."""
        truth = truth or self.truth
        pairs = zip(truth.light[:, 0], truth.view[:, 0], strict=True)
        both = torch.stack([model.picture(*pair) for pair in pairs]), all_values(truth)
        found, expected = ((each * exposure(self.base)).clamp_max(1) if shown else each for each in both)
        return (found.mean() / expected.mean()).item()

    def psnr(self, model, truth=None, shown=None):
        """Return the PSNR, dB, of a model's pictures at the pairs of `truth` (None: of the surface as it is), shown at
        the exposure of the store `shown` (None: the base capture); not a number where a value is not finite."""
        truth = truth or self.truth
        pairs = zip(truth.light[:, 0], truth.view[:, 0], strict=True)
        found = torch.stack([model.picture(*pair) for pair in pairs])
        if not found.isfinite().all():
            return math.nan
        factor = exposure(shown or self.base)
        return compare_pictures(*(to_srgb8(pictures, factor) for pictures in (all_values(truth), found)))[0].mean()


def held(store):
    """Return a BtfStore in memory, so that its file may be written over."""
    return of_values(store, store.values(range(store.sweeps)))


def of_values(store, values, sweeps=slice(None)):
    """Return a BtfStore of other values (s, H, W, 3) at the directions of `sweeps` of `store`."""
    return BtfStore.from_arrays(values, store.light[sweeps], store.view[sweeps], **attributes(store))


def all_values(store):
    """Return all values (s, H, W, 3) of a BtfStore, float32."""
    return store.values(range(store.sweeps)).float()


def at_texels(model, light, view):
    """Return values (n, 3) of a model at its texels in turn, for pairs of directions (n, 3)."""
    features = model.positional().flatten(0, 1)
    return model.eval(features[torch.arange(len(light)) % len(features)], light, view)


def accepted(model):
    """Return the result of a case that should have been refused before there was a model."""
    return f"accepted, a {type(model).__name__}", False


def brightest(store):
    """Return the largest value of a BtfStore, 1/sr."""
    return store.values(range(store.sweeps)).max().item()
