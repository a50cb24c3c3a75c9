"""Neural representations: planes of features and a small network (Xu et al. 2024, equations 4 and 8)."""

import math
from dataclasses import dataclass, replace

import torch

from neumat.btf.exposure import exposure
from neumat.btf.representations.angular import gather, nodes
from neumat.btf.representations.base import Representation
from neumat.btf.representations.batches import batches, rows_of_pairs
from neumat.btf.representations.encoding import Encoding
from neumat.btf.representations.levels import Levels
from neumat.btf.representations.network import forward
from neumat.btf.representations.storage import packed, unpacked
from neumat.btf.representations.training import errors, train
from neumat.errors import NeumatError
from neumat.seeds import torch_generator

BLOCK = 1 << 14  # of values evaluated at a time
SLOWER = (1, 4, 16)  # what learning rates are divided by, where a fit has failed
MARGIN = 0.02  # of the encoded values, that a fit may be worse than a constant: constants are BTFs, too


@dataclass(kw_only=True)
class Neural(Representation):
    """A plane of positions, planes of directions, and a network without biases on top of their features.

    channels: of the plane of positions. side, features: nodes along a side and channels of each plane of directions.
    width, hidden: units in a hidden layer, and hidden layers. curve: of the `Encoding` that the network answers in.
    loss: one of `network.LOSSES`. samples: values that training visits. rate, texel_rate: the highest learning rates of
    network and planes of directions, and of the plane of positions. bits: of a number in a stored plane, 32, 16 or 8;
    the network is stored as float32.
    """

    channels: int = 8
    side: int = 16
    features: int = 8
    width: int = 32
    hidden: int = 3
    curve: float = 24.0
    loss: str = "l1"
    samples: int = 150_000_000
    rate: float = 3e-2
    texel_rate: float = 0.1
    bits: int = 16

    def parametrise(self, light, view):
        """Return ([position (p, 2) on each plane of directions], extra inputs (e, p)) of light, view (p, 3)."""
        raise NotImplementedError

    def positional(self):
        """Return the plane (H, W, channels) float32."""
        return unpacked("positional", self.state)

    def directional(self):
        """Return the planes of directions [(side, side, features)], float32."""
        return [plane.view(self.side, self.side, self.features) for plane in self._directional()]

    def _fit(self, store, seed, progress):
        return self._train(store, Encoding(exposure(store), self.curve), seed, progress)

    def _train(self, store, encoding, seed, progress):
        """Return the state fitted to a store; a fit that is no better than a constant is tried again at lower rates.

        The best is kept; raises NeumatError where none is finite.
        """
        brightest, size = 0.0, (store.height, store.width)

        def encode(values):
            nonlocal brightest
            encoded = encoding.checked(values)
            brightest = max(brightest, encoded.max().item())
            return encoded

        source = batches(store, encode, torch_generator(seed, "batches"))
        least, best = math.inf, None
        for slower in SLOWER:
            gentle = replace(self, rate=self.rate / slower, texel_rate=self.texel_rate / slower)
            levels = Levels(size, encoding) if self.channels else None
            start = f"{seed}/{slower}"
            fitted = train(gentle, self.parametrise, source, rows_of_pairs(store), start, progress, levels)
            found, constant = errors(self, self.parametrise, next(source), *fitted)
            if found < least:  # NaN is not
                least, best, best_levels = found, fitted, levels
            if found < constant + MARGIN:
                break
        if best is None:
            raise NeumatError(type(self).__name__, "a fit of finite numbers", f"none at rates down to {gentle.rate:g}")
        plane, angular, layers = best
        plane = plane.flatten(1).T.reshape(*size, -1)
        state = self._state(plane, angular, layers, Encoding(encoding.exposure, encoding.curve, brightest))
        for k, level in enumerate(best_levels.planes() if best_levels else (), 1):
            state |= packed(f"level{k}", level, self.bits)
        return state

    def _state(self, plane, angular, layers, encoding):
        """Return what is stored of a plane (H, W, c), planes of directions [(side^2, f)] and layers, but for levels of
        detail."""
        state = packed("positional", plane, self.bits) | {"encoding": encoding.tensor()}
        for k, one in enumerate(angular):
            state |= packed(f"angular{k}", one.detach(), self.bits)
        return state | {f"layer{k}": layer.detach() for k, layer in enumerate(layers)}

    def _eval(self, features, light, view):
        angular = self._angular(light, view)
        layers = self.layers()
        encoding = Encoding(*self.state["encoding"].tolist())
        found = torch.empty(len(features), 3)
        for start in range(0, len(features), BLOCK):
            part = slice(start, start + BLOCK)
            shared = angular if angular.shape[1] == 1 else angular[:, part]
            first = layers[0][:, : self.channels]
            found[part] = encoding.decode(forward(first, layers[1:], features[part].T, shared).T)
        return found

    def _directional(self):
        """Return the planes of directions [(side^2, features)], float32."""
        names = [f"angular{k}" for k in range(len(self.state)) if f"angular{k}" in self.state]
        return [unpacked(name, self.state) for name in names]

    def layers(self):
        """Return the network's matrices."""
        return [self.state[f"layer{k}"] for k in range(self.hidden + 1)]

    def _angular(self, light, view):
        """Return what pairs of directions (n or 1, 3) add to the first layer, (width, n or 1)."""
        light, view = torch.broadcast_tensors(light, view)
        positions, extras = self.parametrise(light, view)
        planes = zip(self._directional(), positions, strict=True)
        inputs = torch.cat([*(gather(plane, *nodes(position, self.side)) for plane, position in planes), extras])
        return self.layers()[0][:, self.channels :] @ inputs
