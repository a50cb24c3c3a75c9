"""The contract of a representation: a BTF compressed into features of positions and a function of directions."""

import abc
import json
import logging
from dataclasses import asdict, dataclass

import torch

from neumat.btf.planes import prefilter
from neumat.btf.representations.storage import unpacked
from neumat.checkpoints import read_checkpoint, write_checkpoint
from neumat.configured import Configured

SCHEMA = "2"
SWEEPS = 8  # in which brightness is compared


@dataclass(kw_only=True)
class Representation(Configured, abc.ABC):
    """One method. Its dataclass fields are its hyperparameters; what `fit` learns is a dict of tensors, `state`."""

    def fit(self, store, seed, progress=iter):
        """Learn the BTF in the BtfStore `store` and return self. `progress` wraps the range of steps.

        Raises NeumatError for a store that the method can't use, and for values that are not finite. Warns where the
        fit is less than half as bright as the store, or more than twice.
        """
        self.size = store.height, store.width
        self.state = self._fit(store, seed, progress)
        share = self.brightness(store)
        if not 0.5 < share < 2:
            logging.warning("the fit has %.2g times the captured brightness: rare highlights, or too short", share)
        return self

    def brightness(self, store):
        """Return the mean of the values over that of those in a BtfStore of this size, both in SWEEPS of its sweeps."""
        features, texel = self.positional().flatten(0, 1), torch.arange(store.height * store.width) % store.pairs
        texel = texel if store.pairs > 1 else texel[:1]
        found = captured = 0.0
        for k in torch.linspace(0, store.sweeps - 1, min(SWEEPS, store.sweeps)).round().long():
            found += self.eval(features, store.light[k, texel], store.view[k, texel]).double().mean().item()
            captured += store.values(k[None]).double().mean().item()
        return found / max(captured, 1e-30)

    @torch.no_grad()
    def eval(self, features, light, view):
        """Return the values (n, 3), 1/sr, with the cosine of the light where the store's have it.

        features (n, c): rows of `positional()`, or what synthesis made of them. light, view: unit vectors (n, 3) or
        (1, 3). Finite and not negative; 0 where light or view is at or below the horizon, or NaN.
        """
        light, view = light.to(features.dtype), view.to(features.dtype)
        usable = [(each[:, 2:] > 0) & each.isfinite().all(1, keepdim=True) for each in (light, view)]
        above = usable[0] & usable[1]
        light, view = (torch.where(above, each, each.new_tensor([0.0, 0.0, 1.0])) for each in (light, view))
        return torch.where(above, self._eval(features, light, view).clamp_min(0), 0)

    def picture(self, light, view):
        """Return the values (H, W, 3) at all texels for one pair of unit vectors (3,)."""
        return self.eval(self.positional().flatten(0, 1), light[None], view[None]).view(*self.size, 3)

    @property
    def bytes(self):
        """The number of bytes of all that is stored but for levels of detail, a third of the plane's for every
        representation."""
        return sum(
            tensor.numel() * tensor.element_size()
            for name, tensor in self.state.items()
            if not name.startswith("level")
        )

    @abc.abstractmethod
    def positional(self):
        """Return the plane (H, W, c) float32 that synthesis works on."""

    def levels(self):
        """Return the levels of detail of the plane, float32: itself, (ceil(H / 2), ceil(W / 2), c), and so on to
        (1, 1, c). A texel of a level decodes to the mean of what the texels under it decode to, exactly or nearly so.

        Those that `state` has by the names level1, level2, ...; if none, means of features, exact where values are
        linear in them.
        """
        names = [f"level{k}" for k in range(1, len(self.state)) if f"level{k}" in self.state]
        if not names:
            return prefilter(self.positional())
        return [self.positional(), *(unpacked(name, self.state) for name in names)]

    @abc.abstractmethod
    def _fit(self, store, seed, progress): ...

    @abc.abstractmethod
    def _eval(self, features, light, view): ...

    def save(self, path):
        """Write the representation as safetensors, its class and config as JSON in the metadata."""
        metadata = {"schema": SCHEMA, "model": type(self).__name__, "config": json.dumps(asdict(self))}
        write_checkpoint(path, metadata | {"size": json.dumps(self.size)}, self.state)

    @classmethod
    def load(cls, path):
        """Read what `save` wrote. Raises NeumatError for another file, class or schema version."""
        metadata, state = read_checkpoint(path, "a saved representation", SCHEMA, cls.__name__)
        loaded = cls(**json.loads(metadata["config"]))
        loaded.state, loaded.size = state, tuple(json.loads(metadata["size"]))
        return loaded
