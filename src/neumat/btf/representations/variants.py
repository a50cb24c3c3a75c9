"""The neural representations: what their planes lie over, and what else their networks are given."""

from dataclasses import dataclass

import torch

from neumat.btf.directions import concentric_square, half_difference, paper_half_difference
from neumat.btf.exposure import exposure
from neumat.btf.representations.encoding import Encoding
from neumat.btf.representations.neural import Neural
from neumat.btf.store import BtfStore


@dataclass(kw_only=True)
class TriplePlane(Neural):
    """The paper's: theta and phi of h and d (Rusinkiewicz) as texture coordinates, nothing else, L1 loss."""

    curve: float = 1.0

    def parametrise(self, light, view):
        angles = torch.stack(paper_half_difference(light, view)).view(2, 2, -1)
        scale, offset = torch.tensor([[[2 / torch.pi], [0.5 / torch.pi]], [[0.0], [0.5]]])
        return list((angles * scale + offset).mT), light.new_empty(0, len(light))


@dataclass(kw_only=True)
class Ours(Neural):
    """A triple plane without seams: h and d by the concentric square; light and view are inputs of the network too."""

    def parametrise(self, light, view):
        h, d = half_difference(light, view)
        extras = torch.cat([light, view, torch.ones_like(light[:, :1])], 1).T
        return [concentric_square(h), concentric_square(d)], extras


@dataclass(kw_only=True)
class Biplane(Neural):
    """Planes of positions and of the half vector; the difference vector is two inputs of the network (Fan et al. 2023).

    Theirs has a large network for all materials; this one has a small one for each, as the others here.
    """

    channels: int = 6
    features: int = 6

    def parametrise(self, light, view):
        h, d = half_difference(light, view)
        return [h[:, :2] / 2 + 0.5], d[:, :2].T


@dataclass(kw_only=True)
class NeuMip(Neural):
    """NeuMIP (Kuznetsov et al. 2021) as modified by Xu et al. 2024: no offset, the finest level only.

    The network 11-25-25-25-3 is given 7 channels of a position and x and y of both directions.
    """

    channels: int = 7
    width: int = 25
    curve: float = 1.0

    def parametrise(self, light, view):
        return [], torch.cat([light[:, :2], view[:, :2]], 1).T


@dataclass(kw_only=True)
class Mean(Neural):
    """One value for the whole patch, a BRDF: the null that other representations have to beat.

    Fitted as `Ours` is, without a plane of positions, to the mean of all texels that see a pair of directions.
    """

    channels: int = 0
    loss: str = "l2"
    samples: int = 1_500_000

    parametrise = Ours.parametrise

    def positional(self):
        """Return a plane (H, W, 1) of zeros: nothing depends on it."""
        return torch.zeros(*self.size, 1)

    def _fit(self, store, seed, progress):
        return self._train(means(store), Encoding(exposure(store), self.curve), seed, progress)

    def _eval(self, features, light, view):
        return super()._eval(features[:, :0], light, view)


def means(store):
    """Return a BtfStore (s, 1, p) of the means over all texels that see the same pair of directions.

    Pairs of all sweeps are put together, 1024 to a sweep where there are so many; the rest is left out.
    """
    order = torch.arange(store.sweeps)
    values = [store.values(index[None]).float().view(-1, store.pairs, 3).mean(0) for index in order]
    tables = torch.cat(values), store.light.flatten(0, 1), store.view.flatten(0, 1)
    pairs = min(1024, len(tables[0]))
    sweeps = len(tables[0]) // pairs
    mean, light, view = (table[: sweeps * pairs].view(sweeps, pairs, 3) for table in tables)
    return BtfStore.from_arrays(mean[:, None], light, view)
