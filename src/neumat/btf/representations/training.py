"""Training of planes and network together, one sweep after the other.

In a sweep every texel is seen once and in order. So the plane of positions is neither gathered nor scattered: it enters
as a dense matrix. A sweep's pairs of directions are fewer than its texels: their features are fetched once a pair.
"""

import math

import torch

from neumat.btf.representations.angular import gather, nodes, scatter
from neumat.btf.representations.network import gradients
from neumat.fields.optimisers import Adam
from neumat.seeds import torch_generator

STEP = 16384  # texels in a step, about: a sweep of more is taken in interleaved parts
WARM = 0.02  # of the steps: the learning rate rises from 0


def learning_rate(progress):
    """Return the share of the full rate at `progress` 0..1: a linear rise, then a cosine to 0."""
    return min(1.0, progress / WARM) * 0.5 * (1 + math.cos(math.pi * progress))


def initial(config, extras, planes, generator):
    """Return (first layer's blocks for positions and directions, other layers, angular planes) to start from."""
    below = config.channels + planes * config.features + extras
    sizes = [(config.width, below), *[(config.width, config.width)] * (config.hidden - 1), (3, config.width)]
    layers = [torch.randn(size, generator=generator) * math.sqrt(2 / size[1]) for size in sizes]
    layers[-1] *= 0.5
    angular = torch.randn(planes, config.side**2, config.features, generator=generator) * 0.3
    first = layers[0].split([config.channels, below - config.channels], 1)
    return [part.contiguous() for part in first], layers[1:], angular


def train(config, parametrise, source, shape, seed, progress=iter):
    """Return (plane (c, K, p), angular planes (a, side^2, f), [layers]) fitted to a source of batches.

    config: the hyperparameters of `neural.Neural`. parametrise: light, view (p, 3) -> ([position (p, 2) on each angular
    plane], extra inputs (e, p)). source: an iterator of `batches.batches`. shape: (K, p). `progress` wraps the range of
    sweeps.
    """
    generator = torch_generator(seed, "representation")
    rows, pairs = shape
    sweeps, parts = max(1, round(config.samples / (rows * pairs))), max(1, min(rows, rows * pairs // STEP))
    normal = torch.tensor([[0.0, 0.0, 1.0]])
    positions, extras = parametrise(normal, normal)
    (first, directional), layers, angular = initial(config, len(extras), len(positions), generator)
    plane = torch.randn(config.channels, rows, pairs, generator=generator) * 0.3
    planes = [plane[:, k::parts].contiguous() for k in range(parts)]
    network = [Adam(tensor) for tensor in (first, directional, angular, *layers)]
    texels = [Adam(part) for part in planes]
    for sweep in progress(range(sweeps)):
        light, view, target = next(source)
        positions, extras = parametrise(light, view)
        places = [nodes(position, config.side) for position in positions]
        for k in range(parts):
            inputs = torch.cat([*(gather(one, *place) for one, place in zip(angular, places, strict=True)), extras])
            of_first, of_layers, of_plane, of_pairs = gradients(
                first, layers, planes[k], directional @ inputs, target[:, k::parts], config.loss
            )
            back = (directional.T @ of_pairs).split(config.features)
            of_angular = [scatter(part, *place, config.side) for part, place in zip(back, places, strict=False)]
            of_angular = torch.stack(of_angular) if places else angular
            share = learning_rate((sweep + k / parts) / sweeps)
            for one, found in zip(network, (of_first, of_pairs @ inputs.T, of_angular, *of_layers), strict=True):
                one.step(found, share * config.rate)
            texels[k].step(of_plane, share * config.texel_rate)
    for k in range(parts):
        plane[:, k::parts] = planes[k]
    return plane, angular, [torch.cat([first, directional], 1), *layers]
