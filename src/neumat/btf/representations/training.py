"""Training of planes and network together, one sweep after the other.

In a sweep every texel is seen once and in order. So the plane of positions is neither gathered nor scattered: it enters
as a dense matrix. A sweep's pairs of directions are fewer than its texels: their features are fetched once a pair.

The network's matrices are trained by SOAP, which gains 0.6 dB over Adam on a
captured weave and takes 6 % more time; planes by Adam.
"""

import math

import torch

from neumat.btf.representations.angular import gather, nodes, scatter
from neumat.btf.representations.network import forward, gradients
from neumat.fields.optimisers import Adam, Soap
from neumat.seeds import torch_generator

STEP = 8192  # texels in a step, about: a sweep of more is taken in interleaved parts
WARM = 0.02  # of the steps: the learning rate rises from 0
MOMENTUM = 0.9  # of SOAP


def learning_rate(progress):
    """Return the share of the full rate at `progress` 0..1: a linear rise, then a cosine to 0."""
    return min(1.0, progress / WARM) * 0.5 * (1 + math.cos(math.pi * progress))


def initial(config, extras, planes, generator):
    """Return (layers, [angular planes (side^2, f)]) to start from.

    The first layer's columns are for the features of positions, of `planes` planes of directions, and `extras` inputs.
    """
    below = config.channels + planes * config.features + extras
    sizes = [(config.width, below), *[(config.width, config.width)] * (config.hidden - 1), (3, config.width)]
    layers = [torch.randn(size, generator=generator) * math.sqrt(2 / size[1]) for size in sizes]
    layers[-1] *= 0.5
    size = (config.side**2, config.features)
    return layers, [torch.randn(size, generator=generator) * 0.3 for _ in range(planes)]


def train(config, parametrise, source, shape, seed, progress=iter, levels=None):
    """Return (plane (c, K, p), [angular planes (side^2, f)], [layers]) fitted to a source of batches.

    config: the hyperparameters of `neural.Neural`. parametrise: light, view (p, 3) -> ([position (p, 2) on each angular
    plane], extra inputs (e, p)). source: an iterator of `batches.batches`. shape: (K, p). `progress` wraps the range of
    sweeps. levels: the `levels.Levels` of the plane, trained beside it, or None.
    """
    generator = torch_generator(seed, "representation")
    rows, pairs = shape
    sweeps, parts = max(1, round(config.samples / (rows * pairs))), max(1, min(rows, rows * pairs // STEP))
    normal = torch.tensor([[0.0, 0.0, 1.0]])
    positions, extras = parametrise(normal, normal)
    layers, angular = initial(config, len(extras), len(positions), generator)
    of_positions, of_pairs = layers[0].tensor_split([config.channels], 1)  # views: they follow the first layer
    plane = torch.randn(config.channels, rows, pairs, generator=generator) * 0.3
    planes = [plane[:, k::parts].contiguous() for k in range(parts)]
    texels, directions = [Adam(part) for part in planes], [Adam(one) for one in angular]
    network = [Soap(layer[None], MOMENTUM) for layer in layers]
    for sweep in progress(range(sweeps)):
        light, view, target = next(source)
        positions, extras = parametrise(light, view)
        places = [nodes(position, config.side) for position in positions]
        for k in range(parts):
            inputs = torch.cat([*(gather(one, *place) for one, place in zip(angular, places, strict=True)), extras])
            found, plane_gradient, pair_gradient = gradients(
                of_positions, layers[1:], planes[k], of_pairs @ inputs, target[:, k::parts], config.loss
            )
            back = (of_pairs.T @ pair_gradient)[: len(inputs) - len(extras)].tensor_split(max(1, len(places)))
            found[0] = torch.cat([found[0], pair_gradient @ inputs.T], 1)
            share = learning_rate((sweep + k / parts) / sweeps)
            if levels and k == 0 and levels.due(sweep, sweeps):
                pair = torch.randint(pairs, (1,), generator=generator)
                whole = _interleaved(planes, plane).flatten(1)
                seen, of_pair = levels.step(
                    whole, of_positions, layers[1:], of_pairs @ inputs[:, pair], config.loss, share * config.texel_rate
                )
                seen[0] = torch.cat([seen[0], of_pair @ inputs[:, pair].T], 1)
                found = [one + other for one, other in zip(found, seen, strict=True)]
            texels[k].step(plane_gradient, share * config.texel_rate)
            for one, part, place in zip(directions, back, places, strict=False):
                one.step(scatter(part, *place, config.side), share * config.rate)
            for one, part in zip(network, found, strict=True):
                one.step(part[None], share * config.rate)
    return _interleaved(planes, plane), angular, layers


def _interleaved(parts, plane):
    """Return `plane` (c, K, p), in place, with every row from one of its `parts` in turn."""
    for k, part in enumerate(parts):
        plane[:, k :: len(parts)] = part
    return plane


def errors(config, parametrise, batch, plane, angular, layers):
    """Return the mean absolute errors of a fit and of the best constant at one batch of `batches.batches`."""
    light, view, target = batch
    positions, extras = parametrise(light, view)
    fetched = [gather(one, *nodes(at, config.side)) for one, at in zip(angular, positions, strict=True)]
    of_positions, of_pairs = layers[0].tensor_split([config.channels], 1)
    pairs = (of_pairs @ torch.cat([*fetched, extras])).repeat(1, target.shape[1])
    found = forward(of_positions, layers[1:], plane.flatten(1), pairs)
    target = target.flatten(1)
    constant = target.median(1, keepdim=True).values
    return (found - target).abs().mean().item(), (constant - target).abs().mean().item()
