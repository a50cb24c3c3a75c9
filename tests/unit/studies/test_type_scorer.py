import math

import numpy as np
import pytest
import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.errors import NeumatError
from neumat.fields.layout import permute_channels
from neumat.metrics.statistics import statistics
from neumat.studies.type_scorer import TypeScorer, accuracies, cross_validate

FAMILIES = {"cloth": "fabric", "gloss": "plastic", "steel": "metal"}


@pytest.fixture
def materials(field):
    """Sources of two common types and one rare one: weights (9, 675), types (9,)."""
    generator = np.random.default_rng(0)
    cloth = [field(albedo=generator.uniform(0.05, 0.3, 3)) for _ in range(4)]
    gloss = [field(albedo=generator.uniform(0.05, 0.3, 3), peak=20 + k, fall=90.0 + k) for k in range(4)]
    weights = torch.stack([*cloth, *gloss, field(peak=90.0)]).float()
    return weights, ["cloth"] * 4 + ["gloss"] * 4 + ["steel"]


def test_no_order_of_the_channels_changes_the_statistics(materials):
    weights, _ = materials
    for order in PERMUTATIONS:
        permuted = statistics(permute_channels(weights, order))
        np.testing.assert_allclose(permuted, statistics(weights), atol=1e-4)


def test_statistics_of_black_are_finite(field):
    assert np.isfinite(statistics(torch.stack([field(), field(albedo=0.5)]))).all()


def test_types_are_told_apart(materials):
    weights, types = materials
    scorer = TypeScorer().fit(weights, types)
    assert scorer.predict(weights).tolist() == types
    top = scorer.top(weights, 3)
    assert top.shape == (9, 3) and all(set(row) == set(FAMILIES) for row in top)
    np.testing.assert_allclose(scorer.probabilities(weights).sum(1), 1)


def test_a_copy_of_a_source_is_judged_by_a_classifier_that_never_saw_it(materials):
    weights, types = materials
    scorer = TypeScorer().fit(weights, types)
    copy = permute_channels(weights[-1:], "gbr")
    assert scorer.predict(copy) == ["steel"]
    assert scorer.probabilities(copy, unseen=True)[0, scorer.classes == "steel"] == 0
    fitted = TypeScorer().fit(weights[:-1], types[:-1])
    np.testing.assert_allclose(scorer.probabilities(copy, unseen=True)[0, :2], fitted.probabilities(copy)[0], atol=1e-3)


def test_cross_validation_leaves_types_of_one_source_out(materials):
    weights, types = materials
    table = cross_validate(weights, types, [FAMILIES[type_] for type_ in types]).set_index("type")
    assert table["sources"].tolist() == table["judged"].tolist() == [4, 4, 1]
    assert table["top1"][:2].tolist() == [1, 1] and math.isnan(table["top1"]["steel"])
    assert table["family_accuracy"].tolist() == [1, 1, 0]


def test_accuracies_count_by_the_wanted_type(materials):
    weights, types = materials
    scorer = TypeScorer().fit(weights, types)
    table = accuracies(scorer, weights[:4], ["cloth", "cloth", "gloss", "cloth"], FAMILIES, unseen=False)
    assert table[["type", "judged", "top1", "top3"]].to_numpy().tolist() == [["cloth", 3, 1, 1], ["gloss", 1, 0, 1]]


def test_one_type_is_refused(materials):
    with pytest.raises(NeumatError, match="types: expected at least two; found 1"):
        TypeScorer().fit(materials[0], ["cloth"] * 9)
