"""How fast a triple plane is fitted: the usual PyTorch against `btf.representations.training`, in one run.

The usual way draws samples of a store at random, fetches each one's features (`embedding_bag`), differentiates by
autograd and updates everything by `torch.optim.Adam`. Planes, network, loss, schedule and samples are the same; the
rates are those that are best for it. It trains no levels of detail, which are in the other's time.
"""

import math
import time
from dataclasses import dataclass

import pandas as pd
import torch

from neumat.btf.representations.angular import nodes
from neumat.btf.representations.encoding import Encoding
from neumat.btf.representations.training import initial, learning_rate
from neumat.btf.representations.variants import Ours
from neumat.seeds import torch_generator

BATCH = 1 << 14  # samples in a step
SHORTEST = 8  # halvings of the samples of a fit


@dataclass(kw_only=True)
class Naive(Ours):
    """`Ours`, trained in the usual way."""

    rate: float = 1e-2
    texel_rate: float = 3e-2

    def _train(self, store, encoding, seed, progress):
        generator = torch_generator(seed, "naive")
        values = encoding.checked(store.values(torch.arange(store.sweeps)).float()).flatten(1, 2)
        brightest, texels = values.max().item(), values.shape[1]
        normal = torch.tensor([[0.0, 0.0, 1.0]])
        positions, extras = self.parametrise(normal, normal)
        layers, planes = initial(self, len(extras), len(positions), generator)
        plane = torch.nn.Parameter(torch.randn(texels, self.channels, generator=generator) * 0.3)
        layers, planes = ([torch.nn.Parameter(each) for each in some] for some in (layers, planes))
        groups = [{"params": [*layers, *planes], "full": self.rate}, {"params": [plane], "full": self.texel_rate}]
        optimiser = torch.optim.Adam(groups, lr=self.rate)
        steps = max(1, round(self.samples / BATCH))
        for step in progress(range(steps)):
            sweep = torch.randint(store.sweeps, (BATCH,), generator=generator)
            texel = torch.randint(texels, (BATCH,), generator=generator)
            pair = texel % store.pairs
            places, extras = self.parametrise(store.light[sweep, pair], store.view[sweep, pair])
            features = [plane[texel]]
            for one, place in zip(planes, places, strict=True):
                index, weight = nodes(place, self.side)
                features.append(
                    torch.nn.functional.embedding_bag(
                        index.T.contiguous(), one, mode="sum", per_sample_weights=weight.T.contiguous()
                    )
                )
            x = torch.cat([*features, extras.T], 1)
            for layer in layers[:-1]:
                x = torch.relu(torch.nn.functional.linear(x, layer))
            error = torch.nn.functional.linear(x, layers[-1]) - values[sweep, texel]
            loss = error.abs().mean() if self.loss == "l1" else error.square().mean()
            for group in optimiser.param_groups:
                group["lr"] = group["full"] * learning_rate(step / steps)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        encoding = Encoding(encoding.exposure, encoding.curve, brightest)
        return self._state(plane.detach().view(store.height, store.width, -1), planes, layers, encoding)


def held_out_loss(fitted, held):
    """Return the mean absolute error in the encoded space of a representation at a store of pictures `held`."""
    encoding = Encoding(*fitted.state["encoding"].tolist())
    errors = []
    for k in range(held.sweeps):
        found = fitted.picture(held.light[k, 0], held.view[k, 0])
        expected = held.values(torch.tensor([k]))[0].float()
        errors.append((encoding.encode(found) - encoding.encode(expected)).abs().mean())
    return torch.stack(errors).mean().item()


def fit_bench(store, held, config, seed, rounds=2):
    """Return a DataFrame with a row for each training: method, samples, cpu_seconds, samples_per_second, loss, and
    equal_loss_seconds: CPU seconds to the loss that the usual way ends with, see `seconds_to_loss`.

    store: a BtfStore of queries; held: one of pictures at other directions, on which the loss is taken. config: of
    `Ours`. The two methods take turns, `rounds` times; rates are the best round's, each on as many cores as PyTorch has
    (one, where threads are set so).
    """
    found = {"naive": [], "ours": []}
    for k in range(rounds):
        for name, kind in (("naive", Naive), ("ours", Ours)):
            found[name].append(_timed(kind.from_config(config), store, held, f"{seed}/{k}"))
    rows = {}
    for name, runs in found.items():
        seconds = min(run[0] for run in runs)
        rows[name] = {"samples": runs[0][2], "cpu_seconds": seconds, "samples_per_second": runs[0][2] / seconds}
        rows[name]["loss"] = sum(run[1] for run in runs) / rounds
    usual, ours = rows["naive"], rows["ours"]
    usual["equal_loss_seconds"] = usual["cpu_seconds"]
    full = ours["cpu_seconds"], ours["loss"], ours["samples"]
    ours["equal_loss_seconds"] = seconds_to_loss(
        lambda samples: _timed(Ours.from_config(config | {"samples": samples}), store, held, f"{seed}/0"),
        full,
        usual["loss"],
    )
    return pd.DataFrame([{"method": name} | row for name, row in rows.items()])


def seconds_to_loss(fit, full, loss):
    """Return the seconds after which whole fits, each with a schedule of its own, reach `loss`; NaN where none does.

    fit: samples -> (seconds, loss, samples); full: the same of the longest fit. Samples are halved until a fit misses
    the loss, SHORTEST times at most; between the last two fits the logarithm of the seconds is interpolated linearly.
    """
    if not full[1] <= loss:
        return math.nan
    enough = full
    for _ in range(SHORTEST):
        short = fit(max(1, enough[2] // 2))
        if not short[1] <= loss:
            place = (short[1] - loss) / (short[1] - enough[1])
            return short[0] * (enough[0] / short[0]) ** place
        enough = short
    return enough[0]


def _timed(model, store, held, seed):
    """Return (CPU seconds, held-out loss, samples) of the fit of a model."""
    start = time.process_time()
    fitted = model.fit(store, seed=seed)
    return time.process_time() - start, held_out_loss(fitted, held), fitted.samples
