import numpy as np
import pytest
import torch

from neumat.fields.layout import permute_channels
from neumat.studies.text_scorer import TextScorer, cross_validate, material_texts, retrieval_rank, words

ORDERS = ("rgb", "gbr", "brg")  # red, blue and green


@pytest.fixture
def materials(field):
    """Ten matte and ten shiny sources in three colours each: weights (60, 675), descriptions and sources (60,)."""
    generator = np.random.default_rng(0)
    cloth = [field(albedo=(generator.uniform(0.2, 0.3), 0.02, 0.02)) for _ in range(10)]
    toys = [field(albedo=(generator.uniform(0.2, 0.3), 0.02, 0.02), peak=20 + k) for k in range(10)]
    weights = [permute_channels(source, order) for source in cloth + toys for order in ORDERS]
    return torch.stack(weights), ["fabric"] * 30 + ["plastic"] * 30, np.repeat(np.arange(20), 3)


def test_words_are_normalised_and_followed_by_what_they_imply():
    assert words("Shiny GREY toy") == ["glossy", "gray", "toy", "plastic"]
    assert words("silk!") == ["silk", "fabric", "satin"]
    assert words("") == []


def test_texts_name_what_is_measured(materials):
    weights, descriptions, _ = materials
    texts = material_texts(weights, descriptions)
    assert texts[:3] == ["matte red fabric", "matte blue fabric", "matte green fabric"]
    assert texts[30] == "glossy red plastic"


def test_prompts_find_their_materials(materials):
    weights, descriptions, sources = materials
    scorer = TextScorer().fit(weights, material_texts(weights, descriptions), sources)
    scores = scorer.scores(weights, ["shiny red toy", "green cloth", "xyzzy"])
    assert scores.shape == (60, 3) and (scores[:, 2] == 0).all()
    red_toys, green_cloth = scores[30::3, 0], scores[2:30:3, 1]
    assert red_toys.min() > np.delete(scores[:, 0], range(30, 60, 3)).max()
    assert green_cloth.min() > np.delete(scores[:, 1], range(2, 30, 3)).max()


def test_a_copy_of_a_source_is_judged_by_a_model_that_never_saw_it(materials):
    weights, descriptions, sources = materials
    descriptions = ["widget"] * 3 + descriptions[3:]  # a word of the first source only
    scorer = TextScorer().fit(weights, material_texts(weights, descriptions), sources)
    assert (scorer.scores(weights[:3], ["widget"]) > 0.05).all()
    assert (scorer.scores(weights[:3], ["widget"], unseen=True) == 0).all()


def test_ranks_count_what_scores_higher():
    scores = np.array([[0.9, 0.5, 0.1], [0.2, 0.2, 0.8], [0.0, 0.0, 0.0]])
    assert retrieval_rank(scores, [1, 0, 2]).tolist() == [2, 2.5, 2]


def test_cross_validation_ranks_materials_of_other_sources(materials):
    weights, descriptions, sources = materials
    table = cross_validate(weights, material_texts(weights, descriptions), sources)
    assert len(table) == 60 and (table["prompts"] == 6).all()
    assert (table["rank"] == 1).mean() > 0.95
