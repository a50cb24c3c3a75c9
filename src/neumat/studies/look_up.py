"""Answers looked up among known materials by the very score that serves requests: what a model must beat."""

import functools

import torch

from neumat.augment.dense import dense_indices
from neumat.augment.permutations import PERMUTATIONS
from neumat.conditions.appearance import rendered_appearance
from neumat.conditions.choice import CHOOSY, colourless, only_shown
from neumat.conditions.diversity import most_different
from neumat.conditions.recolouring import own_colours, recoloured
from neumat.fields.dense_store import read_dense_fields
from neumat.fields.layout import permute_channels
from neumat.fields.validity import physical
from neumat.metrics.appearance import appearance
from neumat.seeds import torch_generator


class LookUp:
    """The look-up of a Synthesiser's requests among fields (N, 675)."""

    def __init__(self, synthesiser, weights):
        self.synthesiser, self.weights = synthesiser, weights

    @functools.cached_property
    def _seen(self):
        return self.synthesiser.seen(self.weights, ()).view(1, len(self.weights))

    @functools.cached_property
    def _rendered(self):
        return rendered_appearance(self.weights)

    def answers(self, asked, n, candidates):
        """Return fields (r, n, 675) for r requests, {modality: rows, as encoded}: for a picture those that look most
        like what it shows; else different ones of those that answer best, of as many as are left of the candidates of a
        model that draws so many for each."""
        order = self._order(asked)
        if only_shown(asked):
            return self.weights[order[:, :n]]
        best = self.weights[order[:, : max(n, n * candidates // CHOOSY)]]
        return best[torch.arange(len(best))[:, None], most_different(best, n)]

    def recoloured(self, asked, n, candidates):
        """Return the same of as many as a model has candidates, those that answer best but for their colour, each in
        the colour that is asked for."""
        best = self.weights[self._order(colourless(asked))[:, : n * candidates]]
        return self.synthesiser.best(self.synthesiser.recoloured(best, asked), asked, n)

    def _order(self, asked):
        """Return positions (r, N), those first that answer best; of equally good ones any."""
        if only_shown(asked):
            return self.synthesiser.alike(asked["image"], self._rendered)
        shuffled = torch.randperm(len(self.weights), generator=torch_generator(0, "look-up"))
        score = self.synthesiser.fit(self._seen, asked)
        return shuffled[score[:, shuffled].argsort(dim=1, descending=True, stable=True)]


def in_colours_of(weights, others):
    """Return fields (n, 675) in the colours of other materials, of which the appearance, n rows, is given; one that
    would be no BRDF stays."""
    made = recoloured(weights, appearance(weights), own_colours(others))
    return torch.where(physical(made)[:, None], made, weights)


def dense_materials(path, manifest, protocol):
    """Return the fields (n, 675) of the dense set in `path` that `protocol` trains on and whose fits have converged, in
    the six orders of their channels."""
    fields = read_dense_fields(path)
    own = dense_indices(fields.rows, manifest, protocol)
    weights = fields.weights[torch.from_numpy(own[fields.fits["converged"][own]])]
    return torch.cat([permute_channels(weights, order) for order in PERMUTATIONS])
