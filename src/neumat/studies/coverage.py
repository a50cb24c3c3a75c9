"""Coverage of unseen sources, precision, novelty and validity of samples, beside those of nulls; and what the denoiser
knows by heart."""

import numpy as np
import pandas as pd
import torch

from neumat.augment.manifest import protocol_indices, read_manifest, source_rows
from neumat.augment.permutations import PERMUTATIONS
from neumat.brdf.coordinates import grid_angles
from neumat.brdf.sources import read_sources
from neumat.errors import NeumatError
from neumat.fields.field import evaluate
from neumat.fields.store import read_neumerl
from neumat.fields.validity import physical
from neumat.generative.training import device
from neumat.metrics.coverage import brightest_first, coverage, nearest, nearest_other, nearest_tinted
from neumat.metrics.materials import MaterialSet, metric_entries
from neumat.seeds import torch_generator
from neumat.studies.nulls import NULLS

MODEL = "hyperdiffusion"
JUDGED = 1000  # samples of which precision, novelty and validity are medians and shares
TINTED, TINTED_STEP = 300, 4  # samples, and a step through the entries, of distances after the best gain
LEVELS = (0.1, 0.3, 1.0, 3.0, 10.0)  # of noise, at which the denoiser's error is taken
COLUMNS = ["protocol", "method", "level", "measure", "size", "item", "value"]


class Sides:
    """The two sides of a fold: training bases, the sources among them, and the held-out sources.

    paths: neumerl, manifest and sources; entries: how many metric entries; dense: the config's section
    `augment.dense`. Attributes: weights {side: (n, 675)}, and MaterialSets training, sources and held_out, brightest
    channel first; names of the sources among the training materials. Raises NeumatError where the protocol is no fold.
    """

    def __init__(self, protocol, paths, entries, dense, seed):
        if not protocol.startswith("fold"):
            raise NeumatError("protocol of coverage", "a fold, which holds out sources", protocol)
        neumerl, manifest, sources = paths
        rows, weights = read_manifest(manifest), read_neumerl(neumerl).weights
        train, reference = protocol_indices(rows, protocol)
        plain = np.arange(0, len(rows), len(PERMUTATIONS))
        bases, measured = np.intersect1d(train, plain), source_rows(rows)["index"]
        indices = {
            "training": bases,
            "sources": np.intersect1d(bases, measured),
            "held_out": np.intersect1d(reference, plain),
        }
        self.protocol, self.dense, self.seed = protocol, dense, seed
        self.names = list(rows["base"][indices["sources"]])
        self.entries = metric_entries(read_sources(sources).entries, entries, seed)
        self.weights = {side: weights[torch.from_numpy(found)] for side, found in indices.items()}
        self.training, self.sources, self.held_out = (self.fields(weights) for weights in self.weights.values())

    def fields(self, weights):
        """Return the MaterialSet of fields (n, 675), brightest channel first."""
        return brightest_first(MaterialSet(self.entries, evaluate(weights, *grid_angles(self.entries))))

    def judge(self, samples, method, level, sizes):
        """Return the rows, a DataFrame with COLUMNS, of samples: a MaterialSet, or fields (n, 675).

        Measures: coverage for each size and held-out source (item); medians over the first samples of precision and of
        novelty, against the training sources, after the best gain, and against all training bases; and the share of
        fields that are valid.
        """
        share = physical(samples[:JUDGED]).float().mean().item() if isinstance(samples, torch.Tensor) else np.nan
        materials = self.fields(samples) if isinstance(samples, torch.Tensor) else brightest_first(samples)
        covered = coverage(self.held_out, materials, sizes)
        rows = [("coverage", size, i, value) for size, row in zip(sizes, covered, strict=True) for i, value in
                enumerate(row.tolist())]  # fmt: skip
        first = materials[:JUDGED]
        real = MaterialSet(self.entries, torch.cat([self.sources.brdf, self.held_out.brdf]))
        rows += [
            ("precision", len(first), 0, nearest(first, real).median().item()),
            *self._novelty(first),
            ("valid", len(first), 0, share),
        ]
        return self._frame(rows, method, level)

    def own(self):
        """Return the rows of the materials themselves: of real ones among each other, of held-out ones to training."""
        real = MaterialSet(self.entries, torch.cat([self.sources.brdf, self.held_out.brdf]))
        precision = ("precision", len(real), 0, nearest_other(real).median().item())
        return self._frame([precision, *self._novelty(self.held_out)], "held-out", 0)

    def _novelty(self, materials):
        few = materials[:TINTED].thinned(TINTED_STEP)
        tinted = nearest_tinted(few, self.sources.thinned(TINTED_STEP))
        yield "novelty", len(materials), 0, nearest(materials, self.sources).median().item()
        yield "novelty, any tint", len(few), 0, tinted.median().item()
        yield "novelty, bases", len(materials), 0, nearest(materials, self.training).median().item()

    def _frame(self, rows, method, level):
        frame = pd.DataFrame(rows, columns=["measure", "size", "item", "value"])
        return frame.assign(protocol=self.protocol, method=method, level=level)[COLUMNS]


def measure(sides, model, sizes, seed, progress=iter):
    """Return the rows of the model, a fitted HyperDiffusion, and of every null at every level; see Sides.judge.

    sizes: numbers of samples, of which every method gives the largest; seed: of the model's samples.
    """
    n = max(sizes)
    rows = [sides.own(), sides.judge(model.draw(n, seed), MODEL, 0, sizes)]
    for name, level in progress([(name, level) for name, (_, levels) in NULLS.items() for level in levels]):
        generator = torch_generator(sides.seed, "null", name, level, sides.protocol)
        rows.append(sides.judge(NULLS[name][0](sides, n, level, generator), name, level, sizes))
    return pd.concat(rows, ignore_index=True)


@torch.no_grad()
def denoising_error(sides, model):
    """Return protocol, sigma, side, error, materials: the mean squared error of the denoiser of a fitted
    HyperDiffusion over the fold's training bases, its sources and its held-out sources, in units of the data's
    variance. A model that knows its training materials by heart denoises these far better than held-out ones.
    """
    coordinates, denoiser = model.restored()
    rows = []
    variance = coordinates.encode(model.sorted(sides.weights["training"])[0]).square().mean().item()
    for side, weights in sides.weights.items():
        data = coordinates.encode(model.sorted(weights)[0])
        for sigma in LEVELS:
            noise = torch.randn(data.shape, generator=torch_generator(sides.seed, "audit", side))
            noisy, level = (data + sigma * noise).to(device()), torch.tensor(sigma, device=device())
            error = (denoiser(noisy, level).cpu() - data).square().mean().item() / variance
            rows.append((sides.protocol, sigma, side, error, len(weights)))
    return pd.DataFrame(rows, columns=["protocol", "sigma", "side", "error", "materials"])
