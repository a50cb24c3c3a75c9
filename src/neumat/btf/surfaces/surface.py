"""A surface: one of the processes, scaled to its relief, with its materials."""

import functools
import math

import torch

from neumat.btf.surfaces.bricks import bricks
from neumat.btf.surfaces.leather import leather
from neumat.btf.surfaces.metal import metal
from neumat.btf.surfaces.stone import stone
from neumat.btf.surfaces.weave import weave
from neumat.btf.surfaces.wood import wood

# name -> function(points (2, n), seed, period or None, **parameters) -> (height (n,) in any unit, material (n,))
PROCESSES = {function.__name__: function for function in (leather, weave, stone, wood, metal, bricks)}
BLOCK = 1 << 13  # points at a time: their neighbours stay in the cache
SAMPLES = 1 << 16
SIDE = 8  # exemplars along the side of the square in which an endless surface is measured
OUTSIDE = 0.001  # share of the heights below, and above, what counts as the relief


class Surface:
    """The surface of a config that `load_surface` returned; pure functions of u, float64 (n, 2), any real numbers.

    Lengths are in units of the exemplar's side. The plane of mean height is z = 0, and `config["relief"]` is the
    height between the lowest and the highest thousandth of the surface. A tileable surface repeats after one exemplar.
    """

    def __init__(self, config, endless=False):
        """endless: without the period of a tileable surface."""
        self.config, self.endless = config, endless
        self.materials, self.size_mm = config["materials"], config["size_mm"]
        self.tileable = config["tileable"] and not endless

    def at(self, u):
        """Return the height (n,), float64, and the index of the material (n,), int64, at u (n, 2)."""
        if not len(u):
            return torch.zeros(0, dtype=torch.float64), torch.zeros(0, dtype=torch.int64)
        height, material = self._raw(u.double(), 1 if self.tileable else None)
        return (height - self._mean) * self._scale, material

    def height(self, u):
        """Return the height (n,), float64, at u (n, 2)."""
        return self.at(u)[0]

    def material(self, u):
        """Return the index of the material (n,), int64, at u (n, 2)."""
        return self.at(u)[1]

    def infinite(self):
        """Return the same surface without period, as large as one likes."""
        return Surface(self.config, endless=True)

    def scaled(self, factor):
        """Return the same surface with `factor` times its relief."""
        return Surface({**self.config, "relief": self.config["relief"] * factor}, self.endless)

    @functools.cached_property
    def _endless(self):
        return self._measured(None)

    @functools.cached_property
    def _mean(self):
        """The mean height of one exemplar that repeats, or of SIDE^2 exemplars, as the process returns it."""
        return self._measured(1)[0] if self.tileable else self._endless[0]

    @functools.cached_property
    def _scale(self):
        """The same with and without period: an exemplar and its truth are in one scale."""
        return self.config["relief"] / max(self._endless[1], 1e-9)

    def _measured(self, period):
        """Return the mean height and the relief of the process, rounded: the same for any number of threads."""
        steps = torch.tensor([0.7548776662466927, 0.5698402909980532], dtype=torch.float64)  # Roberts's R2 sequence
        u = torch.arange(SAMPLES, dtype=torch.float64)[:, None] * steps % 1
        height = self._raw(u * (period or SIDE), period)[0]
        rank = int(OUTSIDE * SAMPLES)
        ranked = height.sort().values
        return round(height.mean().item(), 9), round((ranked[-rank] - ranked[rank]).item(), 9)

    def _raw(self, u, period):
        """Return heights in the process's unit, and materials, at u (n, 2)."""
        turn = 0.0 if self.config["tileable"] else math.radians(self.config["turn"])
        cos, sin = math.cos(turn), math.sin(turn)
        process = PROCESSES[self.config["process"]]
        parts = []
        for block in u.split(BLOCK):
            x, y = block[:, 0], block[:, 1]
            points = torch.stack([x * cos - y * sin, x * sin + y * cos])
            parts.append(process(points, self.config["seed"], period, **self.config["parameters"]))
        height, material = zip(*parts, strict=True)
        return torch.cat(height), torch.cat(material)
