"""What needs no model: copies, noise, interpolations, blends, other colours. Each null is a curve over its level.

A null is a function of the Sides of a fold, of n, its level and a generator, and returns a MaterialSet of n materials,
or fields (n, 675). All are made of the training side alone.
"""

import torch

from neumat.augment.dense import draw_recipe, mix, parents_of
from neumat.fields.dense import largest_albedos
from neumat.generative.mixing import last_layer, mixtures
from neumat.generative.orders import brightest_first
from neumat.metrics.materials import MaterialSet

SPREAD = 0.3  # of the logarithm of a brightness that goes with mixed colours


def copies(sides, n, level, generator):
    """Training bases in random order, all of them before any comes again."""
    count = len(sides.training)
    return sides.training[torch.randperm(count, generator=generator)[torch.arange(n) % count]]


def noisy_copies(sides, n, level, generator):
    """Fields of training bases, with noise of `level` times each weight's standard deviation."""
    weights = sides.weights["training"]
    noise = torch.randn(n, weights.shape[1], generator=generator)
    return weights[_rows(weights, n, generator)] + level * weights.std(0) * noise


def interpolated_bases(sides, n, level, generator):
    """Interpolations of the weights of two training bases; the second one's share is at most `level`."""
    return _interpolated(brightest_first(sides.weights["training"])[0], n, level, generator)


def interpolated_sources(sides, n, level, generator):
    """Interpolations of the weights of two sources; the second one's share is at most `level`."""
    return _interpolated(brightest_first(sides.weights["sources"])[0], n, level, generator)


def recoloured_interpolations(sides, n, level, generator):
    """Interpolations of the weights of sources, colours mixed by up to `level`, of another brightness."""
    fields = sides.fields(interpolated_sources(sides, n, 1.0, generator))
    return _recoloured(fields, level, generator)


def powers_of_interpolations(sides, n, level, generator):
    """The mixtures that the default model learns, with powers of 1 + f of the spread `level`."""
    weights = brightest_first(sides.weights["sources"])[0]
    return mixtures(weights, last_layer(weights), n, level, generator)


def blends(sides, n, level, generator):
    """Blends of two sources; the second one's share is at most `level`."""
    first, second, share = _pairs(sides.sources, n, level, generator)
    return _values(sides, torch.lerp(first, second, share))


def logarithmic_blends(sides, n, level, generator):
    """Blends of two sources' log(1 + f); the second one's share is at most `level`."""
    first, second, share = _pairs(sides.sources, n, level, generator)
    return _values(sides, torch.lerp(first.log1p(), second.log1p(), share).expm1())


def brightened(sides, n, level, generator):
    """Sources of another brightness: its logarithm is normal, with the standard deviation `level`."""
    values = sides.sources.brdf[_rows(sides.sources, n, generator)]
    return _values(sides, values * (level * torch.randn(n, 1, 1, generator=generator)).exp())


def recoloured(sides, n, level, generator):
    """Sources whose colours are mixed by up to `level`, of another brightness."""
    return _recoloured(sides.sources[_rows(sides.sources, n, generator)], level, generator)


def dense(sides, n, level, generator):
    """Fresh draws of the recipe of AugMERL, dense; level: the share of blends of log(1 + f)."""
    names, config = sides.names, sides.dense | {"logarithmic": level}
    albedo = largest_albedos(sides.weights["sources"])
    first = int(torch.randint(1 << 30, (), generator=generator))
    rows = draw_recipe(names, albedo, range(first, first + n), config, first)
    numbers, where = parents_of(rows, names, "the sources of a fold")
    return _values(sides, torch.from_numpy(mix(sides.sources.brdf.numpy()[numbers], where, rows)))


NULLS = {
    "copies": (copies, (0,)),
    "noisy-copies": (noisy_copies, (0.02, 0.05, 0.1, 0.2, 0.4)),
    "interpolations": (interpolated_bases, (0.25, 0.5, 1.0)),
    "interpolated-sources": (interpolated_sources, (0.25, 0.5, 1.0)),
    "recoloured-interpolations": (recoloured_interpolations, (0.0, 0.4, 0.8)),
    "powers-of-interpolations": (powers_of_interpolations, (0.05, 0.1, 0.2, 0.3)),
    "blends": (blends, (0.25, 0.5, 1.0)),
    "logarithmic-blends": (logarithmic_blends, (0.25, 0.5, 1.0)),
    "brightened": (brightened, (0.1, 0.3, 0.6)),
    "recoloured": (recoloured, (0.4, 0.8)),
    "dense": (dense, (0.0, 0.5, 1.0)),
}


def _rows(materials, n, generator):
    return torch.randint(len(materials), (n,), generator=generator)


def _interpolated(weights, n, level, generator):
    first, second = (weights[_rows(weights, n, generator)] for _ in range(2))
    return torch.lerp(first, second, level * torch.rand(n, 1, generator=generator))


def _pairs(materials, n, level, generator):
    first, second = (materials.brdf[_rows(materials, n, generator)] for _ in range(2))
    return first, second, level * torch.rand(n, 1, 1, generator=generator)


def _recoloured(materials, level, generator):
    """Return the MaterialSet with channels mixed by convex rows, and of another brightness."""
    n = len(materials)
    rows = torch.empty(n, 3, 3).exponential_(generator=generator)
    share = level * torch.rand(n, 1, 1, generator=generator)
    mixing = torch.lerp(torch.eye(3), rows / rows.sum(2, keepdim=True), share)
    brightness = (SPREAD * torch.randn(n, 1, 1, generator=generator)).exp()
    return MaterialSet(materials.entries, brightness * materials.brdf @ mixing.mT)


def _values(sides, brdf):
    return MaterialSet(sides.sources.entries, brdf)
