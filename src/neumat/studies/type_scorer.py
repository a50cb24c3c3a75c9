"""Which of the types a material is, by a classifier of BRDF statistics: an independent judge of conditional samples."""

import numpy as np
import pandas as pd
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from neumat.errors import NeumatError
from neumat.metrics.statistics import statistics

# Of the penalties that are equally good at sources left out, the smallest: with it all sources but one are learnt, so
# that types with a single source can be recognised.
INVERSE_PENALTY = 1.0


class TypeScorer:
    """Multinomial logistic regression on standardised `statistics`, which no order of the colour channels changes.

    Leaving one of the 100 sources out, it is as good as extra trees and better than linear discriminants, nearest
    neighbours and support vectors.

    There are two ways to judge: by the classifier that knows all sources, and, with `unseen`, by one that has never
    seen the source nearest (by its statistics) to what it judges. `cross_validate` judges the sources in the second
    way, as each is nearest to itself. So only figures made with `unseen` compare with the cross-validated ceiling: a
    sample that copies its training material is recognised no better there than another material of its type.
    """

    def fit(self, weights, types):
        """Fit to sources (n, 675) of types (n,), each source once, unpermuted; return self.

        Raises NeumatError for fewer than two types.
        """
        self.sources, self.types = statistics(weights), np.asarray(types, dtype=str)
        self.classes = np.unique(self.types)
        if len(self.classes) < 2:
            raise NeumatError("types", "at least two", len(self.classes))
        self.all = self._fitted(np.ones(len(self.types), bool))
        self.without = {}  # index of a source -> the classifier that has never seen it, made when it is wanted
        return self

    def predict(self, weights):
        """Return the type (n,) of each of the fields (n, 675)."""
        return self.top(weights, 1)[:, 0]

    def top(self, weights, k, unseen=False):
        """Return the k most probable types of fields (n, 675), best first: array (n, k) of str."""
        return self.classes[_best(self.probabilities(weights, unseen), k)]

    def probabilities(self, weights, unseen=False):
        """Return the probabilities (n, len(classes)) of the types of fields (n, 675), in the order of `classes`.

        unseen: by the classifier without the source nearest to each; a type that only this source has gets 0.
        """
        x = statistics(weights)
        if not unseen:
            return self.all.predict_proba(x)
        scaled, sources = (self.all[0].transform(rows) for rows in (x, self.sources))
        nearest = np.square(scaled[:, None] - sources).sum(2).argmin(1)
        found = np.zeros((len(x), len(self.classes)))
        for source in np.unique(nearest):
            if source not in self.without:
                self.without[source] = self._fitted(np.arange(len(self.types)) != source)
            model, own = self.without[source], nearest == source
            found[np.ix_(own, np.isin(self.classes, model.classes_))] = model.predict_proba(x[own])
        return found

    def _fitted(self, chosen):
        model = make_pipeline(StandardScaler(), LogisticRegression(C=INVERSE_PENALTY, max_iter=1000))
        return model.fit(self.sources[chosen], self.types[chosen])


def cross_validate(weights, types, families):
    """Return the table of `accuracies` of the sources themselves, each judged by a classifier that never saw it.

    weights (n, 675), types (n,), families (n,): of the sources. A type with a single source is unknown to the
    classifier that judges it: its top1 and top3 are NaN, and only the family counts.
    """
    scorer = TypeScorer().fit(weights, types)
    table = accuracies(scorer, weights, types, dict(zip(types, families, strict=True)), unseen=True)
    table.loc[table["sources"] < 2, ["top1", "top3"]] = np.nan
    return table


def accuracies(scorer, weights, wanted, families, unseen):
    """Return a DataFrame with a row for each type that was wanted: type, family, sources (of the type), judged
    (materials), and the shares of these with the right type (top1), with it among the best three (top3), and with the
    right family (family_accuracy), which is the one whose types are the most probable together.

    weights (n, 675): of the materials to judge; wanted (n,): their types; families: {type: family}; unseen: see
    TypeScorer, which also says which figures compare. Means over `judged` materials are the overall accuracies.
    """
    wanted = np.asarray(wanted, dtype=str)
    probabilities = scorer.probabilities(weights, unseen)
    best = scorer.classes[_best(probabilities, 3)]
    family = pd.Series([families[type_] for type_ in scorer.classes])
    names = np.unique(family)
    by_family = np.stack([probabilities[:, family == name].sum(1) for name in names], 1)
    hits = pd.DataFrame(
        {
            "type": wanted,
            "top1": best[:, 0] == wanted,
            "top3": (best == wanted[:, None]).any(1),
            "family_accuracy": names[by_family.argmax(1)] == [families[type_] for type_ in wanted],
        }
    )
    groups = hits.groupby("type")
    table = groups.mean().astype(float).reset_index()
    table.insert(1, "family", table["type"].map(families))
    table.insert(2, "sources", [int((scorer.types == type_).sum()) for type_ in table["type"]])
    table.insert(3, "judged", groups.size().to_numpy())
    return table


def _best(scores, k):
    return np.argsort(-scores, 1, kind="stable")[:, :k]
