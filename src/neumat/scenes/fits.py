"""Fits the ladder's models to materials under any distribution of queries.

Queries are drawn in proportion to their weight (see `neumat.scenes.replay.importance`) times f + floor, so that the
mean of |f' - f| / (f + floor) is the error that f' leaves in the picture. Fields minimise that, with the mean error of
each channel or without. An analytic model that can't follow a highlight would do so best without any: it minimises the
mean of |log((f' + floor) / (f + floor))|, and the same of the sums over all queries, as a pixel sees the whole of a
highlight at once.
"""

import functools
import math
import time
from dataclasses import dataclass

import torch

from neumat.brdf.analytic import SGD_PARAMETERS
from neumat.brdf.coordinates import cosines, half_difference
from neumat.fields.fit import learning_rate
from neumat.fields.layout import matrices, widths_of
from neumat.fields.optimisers import Soap
from neumat.scenes.models import WIDTHS, Model
from neumat.seeds import torch_generator

POOL = 1 << 16  # queries drawn from a distribution, that training goes through
ANYWHERE = 0.1  # share of them that is spread over all angles: what a fit does to light that no path found
MOST = 1e-3  # share of all queries that a single one may stand for: paths are few, and some weigh too much
BATCH = 512
PROBES = 1 << 10  # queries by which units are pruned
ANALYTIC_RATE = 0.05
# Learning rates, and weights of each channel's mean error: mirrors need the higher rate, most others the lower; a mean
# error is what is seen of large even areas, but its estimate unsettles fine fits. The best run is kept.
RATES, EVEN = (0.004, 0.01), (0.0, 1.0)
ALPHAS = (0.004, 0.02, 0.1, 0.4)  # roughness that analytic fits start from; the best fit is kept


@dataclass(frozen=True)
class Pools:
    """Queries of u materials: angles, three of (u, POOL), radians; values (u, POOL, 3), 1/sr; floor (u, 1, 1): the mean
    value, below which errors count as absolute ones."""

    angles: list
    values: torch.Tensor
    floor: torch.Tensor

    def batch(self, generator):
        """Return the positions (BATCH,) of a random batch."""
        return torch.randint(POOL, (BATCH,), generator=generator)


def pools(queries, materials, seed):
    """Return the Pools of {unit: (angles, values (q, 3), weight (q, 3))}, drawn by how much each matters.

    materials: {unit: material}, for what is added of all angles.
    """
    drawn = [_pool(*queries[unit], materials[unit], torch_generator(seed, f"pool {unit}")) for unit in queries]
    angles, values, floor = zip(*drawn, strict=True)
    return Pools([torch.stack(axis) for axis in zip(*angles, strict=True)], torch.stack(values), torch.stack(floor))


def even_queries(material, seed):
    """Return the queries (angles, values, weight) of a material under uniform angles, each weighing cos(theta_i)."""
    angles = _anywhere(4 * POOL, torch_generator(seed, "even queries"))
    values = material.eval(*angles)
    return angles, values, cosines(*angles)[0][:, None].expand_as(values)


def _pool(angles, values, weight, material, generator):
    floor = (weight * values).sum() / weight.sum().clamp_min(1e-30)
    floor = floor.clamp_min(1e-6)
    anywhere = round(ANYWHERE * POOL)
    chances = (weight * (values + floor)).sum(1).double()
    chances = chances.clamp_max(float(chances.sum()) * MOST).cumsum(0)
    at = torch.rand(POOL - anywhere, generator=generator, dtype=torch.float64) * chances[-1]
    index = torch.searchsorted(chances, at).clamp_max(len(values) - 1)
    others = _anywhere(anywhere, generator)
    joined = [torch.cat([axis[index], other]) for axis, other in zip(angles, others, strict=True)]
    return joined, torch.cat([values[index], material.eval(*others)]), floor.view(1, 1)


def _anywhere(count, generator):
    """Return uniform angles above the horizon, three of (count,)."""
    span = torch.tensor([math.pi / 2, math.pi / 2, math.pi])
    angles = torch.rand(8 * count, 3, generator=generator) * span
    cos_i, cos_o = cosines(*angles.T)
    return list(angles[(cos_i > 0.01) & (cos_o > 0.01)][:count].T)


def query_error(found, target, floor):
    """Return the error (...), as a share of what is seen, of values (..., n, 3) at n queries drawn by their weight."""
    return ((found - target).abs() / (target + floor)).mean((-2, -1))


def _field_loss(found, target, floor, even):
    """Return `query_error` and, `even` times, the size of each channel's mean error."""
    share = (found - target) / (target + floor)
    return share.abs().mean((-2, -1)) + even * share.mean(-2).abs().mean(-1)


def _analytic_loss(found, target, floor):
    """Return the loss (...) of values (..., n, 3) at n queries."""
    share = (found + floor) / (target + floor)
    return share.log().abs().mean((-2, -1)) + share.mean((-2, -1)).log().abs()


def fit_analytic(rung, pools, steps, seed):
    """Return a Model of an analytic rung for each of the pools' materials, by Adam from several roughnesses."""
    start = time.process_time()
    count = len(pools.values)
    raw = _start(rung, pools).requires_grad_()
    numbers = {"lambert": _lambert, "glossy": _glossy, "sgd": _sgd}[rung]
    value = torch.func.vmap(
        torch.func.vmap(
            lambda x, *angles: Model(rung, numbers(x)).material.eval(*angles), in_dims=(0, None, None, None)
        )
    )
    optimiser = torch.optim.Adam([raw], lr=ANALYTIC_RATE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    generator = torch_generator(seed, "batches")

    def losses(at):
        target = pools.values[:, None, at]
        found = value(raw, *(axis[:, at] for axis in pools.angles))
        return _analytic_loss(found, target, pools.floor[:, None])

    for _ in range(steps):
        optimiser.zero_grad()
        losses(pools.batch(generator)).sum().backward()
        optimiser.step()
        schedule.step()
    with torch.no_grad():
        best = losses(torch.arange(0, POOL, 8)).nan_to_num(torch.inf).argmin(1)
    seconds = (time.process_time() - start) / count
    return [Model(rung, numbers(raw[k, best[k]]).detach().float(), seconds) for k in range(count)]


def _start(rung, pools):
    """Return where analytic fits start, (materials, starts, n), before `_lambert`, `_glossy` or `_sgd`."""
    middle = pools.values.median(1).values.clamp(1e-4, 0.3) * math.pi  # (u, 3): the base's albedo
    base = torch.logit(middle.clamp(1e-3, 0.95))[:, None].expand(-1, len(ALPHAS), -1)
    alpha = torch.tensor(ALPHAS).log()[None, :, None].expand(len(base), -1, 1)
    if rung == "lambert":
        return base.clone()
    if rung == "glossy":
        return torch.cat([base, torch.full_like(base, -1.0), alpha], 2)
    shape = torch.zeros(*base.shape[:2], 3 * len(SGD_PARAMETERS)).unflatten(2, (-1, 3))
    shape[:, :, 0], shape[:, :, 1], shape[:, :, 2] = base, -2.0, 2 * alpha
    shape[:, :, 4], shape[:, :, 7:9], shape[:, :, 10] = -3.0, -2.0, 1.0
    return shape.flatten(2)


def _lambert(x):
    return torch.sigmoid(x)


def _glossy(x):
    return torch.cat([torch.sigmoid(x[..., :6]), torch.exp(x[..., 6:]).clamp(1e-3, 1)], -1)


def _sgd(x):
    soft = torch.nn.functional.softplus
    rho_d, rho_s, alpha, p, f0, f1, kappa, lambda_, c, k, theta0 = x.unflatten(-1, (-1, 3)).unbind(-2)
    numbers = torch.sigmoid(rho_d), torch.exp(rho_s), torch.exp(alpha).clamp(1e-6, 4), p + 1, torch.sigmoid(f0), f1
    numbers = *numbers, torch.ones_like(kappa), soft(lambda_), soft(c), 1 + soft(k), theta0
    return torch.stack(numbers, -2).flatten(-2)


def fit_fields(rungs, pools, fields, steps, seed, progress=iter, judge=None):
    """Return {rung: [Model of each of the pools' materials]} of field rungs, by SOAP from pruned `fields` (u, 675).

    The widest is fitted first. The others start from `fields` and once more from the next wider one's fit, which loses
    less by being pruned but brings its own errors: of all runs, the best by `judge` is kept, which returns the errors
    (u,) of numbers (u, n), and is the training loss where none is given. A Model's seconds are all that it took to come
    to it, the wider ones' included.
    """
    judge = judge or functools.partial(_pool_loss, pools)
    start = time.process_time()
    starts, found = [fields], {}
    for rung in progress(sorted(rungs, key=WIDTHS.get, reverse=True)):
        numbers = _fit_width(WIDTHS[rung], pools, starts, steps, seed, judge)
        seconds = (time.process_time() - start) / len(fields)
        found[rung] = [Model(rung, x, seconds) for x in numbers]
        starts = [fields, numbers]
    return {rung: found[rung] for rung in rungs}


def _fit_width(width, pools, starts, steps, seed, judge):
    """Return the best numbers (u, n) of fields of `width` that come from any of `starts`, [(u, numbers), ...]."""
    first = [pruned(fields, pools, width) for fields in starts]
    found = torch.cat([_descend(first, pools, rate, steps, seed) for rate in RATES])
    best = torch.stack([judge(numbers) for numbers in found]).nan_to_num(torch.inf).argmin(0)
    return found[best, torch.arange(len(best))]


def _pool_loss(pools, numbers):
    """Return the loss (u,), each channel's mean included, of fields' numbers (u, n) at an eighth of the pool."""
    at = torch.arange(0, POOL, 8)
    inputs = half_difference(*(axis[:, at] for axis in pools.angles))
    found = _values(inputs, matrices(numbers, widths_of(numbers.shape[1]))).clamp_min(0)
    return _field_loss(found, pools.values[:, at], pools.floor, 1.0)


def _descend(starts, pools, rate, steps, seed):
    """Return the trained numbers (runs, u, n) of fields that come from each of `starts`, as `pruned` gives them, with
    each of EVEN.

    All runs train side by side, on the same batches: a network this small costs little more than its operations' start.
    """
    runs = len(starts) * len(EVEN)
    layers = [torch.cat([layer for layer in same for _ in EVEN]).requires_grad_() for same in zip(*starts, strict=True)]
    optimisers = [Soap(layer) for layer in layers]
    inputs = half_difference(*pools.angles)
    even = torch.tensor(EVEN).repeat(len(starts))[:, None]
    generator = torch_generator(seed, "batches")
    schedule = {"schedule": "cosine", "learning_rate": rate}
    for step in range(steps):
        at = pools.batch(generator)
        # Values are not clamped at 0, where a channel would be stuck.
        found = _values(inputs[:, at].repeat(runs, 1, 1), layers).unflatten(0, (runs, -1))
        loss = _field_loss(found, pools.values[:, at], pools.floor, even).sum()
        now = learning_rate(step, steps, schedule)
        for optimiser, gradient in zip(optimisers, torch.autograd.grad(loss, layers), strict=True):
            optimiser.step(gradient, now)
    return torch.cat([layer.detach().flatten(1) for layer in layers], 1).unflatten(0, (runs, -1))


@torch.no_grad()
def pruned(fields, pools, width):
    """Return the layers [(u, in + 1, out), ...], the bias as the last row, of fields (u, numbers) with `width` units
    left in each hidden layer.

    The unit goes whose loss costs least, one after the other; its mean value stays, in the biases that follow.
    """
    at = torch.arange(0, POOL, POOL // PROBES)
    inputs = half_difference(*(axis[:, at] for axis in pools.angles))
    target = pools.values[:, at]
    layers = matrices(fields, widths_of(fields.shape[1]))
    while layers[0].shape[2] > width:
        for k in (0, 1):
            units = range(layers[k].shape[2])
            less = [_without(layers, inputs, k, torch.full((len(fields),), j)) for j in units]
            costs = [query_error(_values(inputs, shorter).clamp_min(0), target, pools.floor) for shorter in less]
            layers = _without(layers, inputs, k, torch.stack(costs).argmin(0))
    return layers


def _without(layers, inputs, k, units):
    """Return layers without a unit, one of each material's, of hidden layer k."""
    x = inputs
    for layer in layers[: k + 1]:
        x = torch.relu(_ahead(x, layer))
    here, after = layers[k], layers[k + 1]
    rows, last = torch.arange(len(units)), here.shape[2]
    kept = torch.arange(last - 1) + (torch.arange(last - 1) >= units[:, None])
    narrower = here.gather(2, kept[:, None].expand(-1, here.shape[1], -1))
    with_bias = torch.cat([kept, torch.full_like(units, last)[:, None]], 1)
    shorter = after.gather(1, with_bias[..., None].expand(-1, -1, after.shape[2]))
    shorter[:, -1] += x.mean(1)[rows, units][:, None] * after[rows, units]
    return [*layers[:k], narrower, shorter, *layers[k + 2 :]]


def _ahead(x, layer):
    return x @ layer[:, :-1] + layer[:, -1:]


def _values(inputs, layers):
    """Return f (u, m, 3), 1/sr, at inputs (u, m, 6)."""
    *hidden, last = layers
    for layer in hidden:
        inputs = torch.relu(_ahead(inputs, layer))
    return torch.expm1(_ahead(inputs, last).clamp_max(12))
