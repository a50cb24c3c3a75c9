"""The training materials as a Synthesiser's candidates for a text begin with them."""

import functools

import torch

from neumat.conditions.choice import Seen
from neumat.conditions.ranges import seen
from neumat.metrics.appearance import appearance

TIE = 1e-6  # less than by what scores differ


class Known:
    """weights (N, 675) of training materials; positions (N,): the same for those that differ by the order of their
    channels alone; embedded (N, size): the mean of their embedded pictures over these orders; descriptions: see
    `descriptions.Descriptions`."""

    def __init__(self, weights, positions, embedded, descriptions):
        self.weights, self.positions, self.embedded, self.descriptions = weights, positions, embedded, descriptions

    @functools.cached_property
    def seen(self):
        """What is `Seen` of them, (1, N)."""
        looks = appearance(self.weights)
        return Seen(seen(looks), self.descriptions.of(looks), self.embedded).view(1, len(self.weights))

    def order(self, score):
        """Return the positions (r, D) of D different materials by their score (r, N), the best first; of each that is
        there in several orders of its channels, the best."""
        score = score - TIE * torch.arange(score.shape[1])
        where = self.positions.expand_as(score)
        best = score.new_full((len(score), int(where.max()) + 1), -torch.inf)
        best = best.scatter_reduce(1, where, score, "amax")
        own = score == best.gather(1, where)
        return torch.where(own, score, -torch.inf).argsort(dim=1, descending=True)[:, : best.shape[1]]
