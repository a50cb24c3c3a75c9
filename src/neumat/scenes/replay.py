"""A traced picture with other materials, and how much each query matters to it."""

import torch


def replay(trace, values):
    """Return the radiance (n, 3) of a Trace's paths where the materials have `values`, see `queried`.

    The paths stay those that were traced, so two replays differ by their materials only, not by noise.
    """
    radiance, through = trace.seen, torch.ones_like(trace.seen)
    for depth, vertex in enumerate(trace.vertices):
        lit, onward = (torch.zeros_like(through) for _ in range(2))
        for total, which in ((lit, "lit"), (onward, "onward")):
            for unit, queries in getattr(vertex, which).items():
                total.index_add_(0, queries.path, values[depth, which, unit] * queries.factor)
        radiance = radiance + through * lit
        through = through * onward
        radiance = radiance + through * vertex.met
    return radiance


def queried(trace, models):
    """Return {(vertex, "lit" or "onward", unit): values (q, 3), 1/sr} at the queries of a Trace of those units that are
    in `models`, {unit: anything with eval(theta_h, theta_d, phi_d) -> (q, 3)}."""
    return {
        (depth, which, unit): models[unit].eval(*queries.angles)
        for depth, vertex in enumerate(trace.vertices)
        for which in ("lit", "onward")
        for unit, queries in getattr(vertex, which).items()
        if unit in models
    }


def importance(trace, models, exposure):
    """Return {unit: (angles, values, weight)}: all its queries' angles (three of (q,)), the models' values (q, 3), and
    how much of the picture as shown hangs on each value: the derivative (q, 3) of the sum of its pixels."""
    values = {key: value.requires_grad_() for key, value in queried(trace, models).items()}
    _displayed(trace.picture(replay(trace, values)) * exposure).sum().backward()
    found = {}
    for (depth, which, unit), value in values.items():
        queries = getattr(trace.vertices[depth], which)[unit]
        found.setdefault(unit, []).append((*queries.angles, value.detach(), value.grad))
    joined = {unit: [torch.cat(parts) for parts in zip(*group, strict=True)] for unit, group in found.items()}
    return {unit: ((h, d, p), value, weight) for unit, (h, d, p, value, weight) in joined.items()}


def _displayed(linear):
    """Return sRGB's curve, which beyond 1 levels off slowly: a pixel that is overexposed a little would show it if a
    highlight lost half its light."""
    inside = linear.clamp(0.0031308, 1)
    curve = torch.where(linear < 0.0031308, 12.92 * linear, 1.055 * inside ** (1 / 2.4) - 0.055)
    return torch.where(linear > 1, 1 + 1.055 / 2.4 * (1 - 1 / linear.clamp_min(1)), curve)
