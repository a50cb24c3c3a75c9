"""Constrained synthesis: materials of one category out of what a sampler gives (M3ashy, section 4.5)."""

from dataclasses import dataclass

import h5py
import numpy as np
import torch

from neumat.brdf.categories import categorise, check_category, check_rules
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE
from neumat.fields.mirrored import mended
from neumat.fields.statistics import FieldStatistics
from neumat.fields.validity import valid
from neumat.files import atomic_path
from neumat.seeds import seed_for

LOOK = 41  # a step through the entries that no length of the grid's axes divides


class InCategory:
    """Called with valid weights (k, 675), tells which fields are in a category, bool (k,). rules: see `categorise`.

    A first look at each LOOK-th entry rules most of the others out; what is left is judged on all entries. Of the 400
    fields of the default run it misses 2 of 181 high-specular ones, and none of any other category.
    Raises NeumatError for an unknown category and for thresholds out of order.
    """

    def __init__(self, category, rules):
        check_category(category)
        check_rules(rules)
        self.category, self.rules = category, rules
        self.look, self.statistics = (FieldStatistics(rules["f_diffuse"], every) for every in (LOOK, 1))

    def __call__(self, weights):
        within = self._judge(self.look, weights)
        if within.any():
            within[within] = self._judge(self.statistics, weights[torch.from_numpy(within)])
        return within

    def _judge(self, statistics, weights):
        return categorise(statistics(weights), self.rules)[self.category].to_numpy(copy=True)


@dataclass
class Found:
    """What a search found: weights (k, 675) float32, k <= n; how many candidates were tried, of which so many were
    accepted (k of them are kept) and so many were no valid BRDF."""

    weights: np.ndarray
    tried: int = 0
    accepted: int = 0
    invalid: int = 0


def constrained_samples(sampler, accept, n, budget, batch, seed, progress=None):
    """Return the Found with the first n accepted samples, fewer where `budget` candidates hold no more.

    sampler: (n, seed) -> weights (n, 675), as a model's `draw` gives them; they are mended (`fields.mirrored`). accept:
    weights (k, 675) float32 tensor -> bool (k,); it sees valid BRDFs only (`fields.validity.valid`), others are counted
    and dropped. Candidates come `batch` at a time, each
    batch from a seed of its own, so the result does not depend on n. progress: called with how many more were found.
    Raises NeumatError where a number is below 1 or the sampler returns another shape.
    """
    for name, value in (("n", n), ("budget", budget), ("batch", batch)):
        if value < 1:
            raise NeumatError(f"constrained sampling: {name}", "at least 1", value)
    found, kept = Found(np.empty((0, SIZE), np.float32)), []
    while found.tried < budget and found.accepted < n:
        size = min(batch, budget - found.tried)
        weights = torch.as_tensor(sampler(size, seed_for(seed, "candidates", found.tried)))
        if weights.shape != (size, SIZE):
            raise NeumatError("constrained sampling: sampler", f"samples of shape {(size, SIZE)}", tuple(weights.shape))
        weights = mended(weights)
        whole = valid(weights)
        weights = weights[whole]
        if len(weights):
            weights = weights[torch.tensor(accept(weights), dtype=torch.bool)]
        found.tried += size
        found.accepted += len(weights)
        found.invalid += int((~whole).sum())
        kept.append(weights.numpy())
        if progress:
            progress(len(weights))
    found.weights = np.concatenate(kept)[:n]
    return found


def summary(category, found, n):
    """Return the line that says how a search ended."""
    line = f"{category}: {len(found.weights)} of {n} materials found, {found.accepted} of {found.tried} candidates are"
    line += f" in the category, {found.invalid} no valid BRDFs"
    return line if len(found.weights) == n else f"{line}; the budget is spent (constrained.budget)"


def write_found(path, category, way, found, n, seconds, seed):
    """Write a Found as a file of samples, like results/samples, with its search's account as attributes.

    way: how the candidates were drawn, "rejection" for an unconditional sampler. seconds: of the whole search.
    """
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["samples"] = found.weights
        file.attrs.update(method="hyperdiffusion", kind="weights", stride=1, seed=seed, seconds=seconds)
        file.attrs.update(category=category, way=way, wanted=n, message=summary(category, found, n))
        file.attrs.update(tried=found.tried, accepted=found.accepted, invalid=found.invalid)
