import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.brdf.statistics import F_DIFFUSE
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE
from neumat.fields.mirrored import unfolded_error
from neumat.generative.constrained import InCategory, constrained_samples, summary, write_found
from neumat.studies.constrained import read_found

RULES = {
    "f_diffuse": F_DIFFUSE,
    "exceptions": 80_000,
    "metallic_share": 0.25,
    "specular": [100, 600],
    "plastic_tolerance": 0.05,
    "mirror_width": 0.0349,
}


def constants(n, seed):
    """n fields that are constant in every direction: half of them create energy, one in ten is not finite."""
    generator = np.random.default_rng(seed)
    weights = np.zeros((n, SIZE), np.float32)
    weights[:, -3:] = np.log1p(generator.uniform(0, 2 * F_DIFFUSE, (n, 1)))
    weights[generator.random(n) < 0.1, 0] = np.nan
    return weights


def value(weights):
    return np.expm1(np.asarray(weights)[:, -1])


def dark(weights):
    return value(weights) < 0.1


def test_finds_what_is_accepted_and_counts_the_rest():
    found = constrained_samples(constants, dark, n=5, budget=200, batch=16, seed=0)
    assert found.weights.shape == (5, SIZE) and found.weights.dtype == np.float32
    assert (value(found.weights) < 0.1).all() and np.isfinite(found.weights).all()
    assert 5 <= found.accepted <= found.tried - found.invalid and found.tried % 16 == 0 and found.tried < 200
    assert 0.3 < found.invalid / found.tried < 0.8


def test_invalid_candidates_never_reach_the_rule():
    def accept(weights):
        assert np.isfinite(np.asarray(weights)).all() and (value(weights) < F_DIFFUSE + 1e-3).all()
        return np.ones(len(weights), bool)

    found = constrained_samples(constants, accept, n=1000, budget=64, batch=16, seed=0)
    assert found.accepted + found.invalid == found.tried == 64


@settings(max_examples=20)
@given(st.integers(1, 30), st.integers(1, 60), st.integers(1, 20))
def test_never_more_than_asked_for_nor_beyond_the_budget(n, budget, batch):
    found = constrained_samples(constants, dark, n, budget, batch, seed=1)
    assert len(found.weights) == min(n, found.accepted) and found.tried <= budget
    assert found.tried == budget or len(found.weights) == n


def test_what_was_found_is_right_without_folding_too(leaning):
    """Half of the candidates are far off as they are drawn."""

    def half_wrong(n, seed):
        return torch.stack([leaning(k % 2) for k in range(n)])

    found = constrained_samples(half_wrong, lambda weights: np.ones(len(weights), bool), 4, 4, 4, seed=0)
    assert found.accepted == 4 and (unfolded_error(torch.from_numpy(found.weights)) < 0.02).all()


def test_a_smaller_request_gives_the_first_of_a_larger_one():
    small, large = (constrained_samples(constants, dark, n, 400, 16, seed=2).weights for n in (3, 9))
    assert np.array_equal(small, large[:3])


def test_a_spent_budget_says_so():
    found = constrained_samples(constants, lambda weights: np.zeros(len(weights), bool), 4, 10, 4, seed=0)
    assert found.weights.shape == (0, SIZE) and found.tried == 10
    assert summary("plastic", found, 4).startswith("plastic: 0 of 4 materials found, 0 of 10 candidates")
    assert "the budget is spent" in summary("plastic", found, 4)


def test_progress_adds_up():
    steps = []
    found = constrained_samples(constants, dark, 5, 200, 16, seed=0, progress=steps.append)
    assert sum(steps) == found.accepted


def test_what_was_found_reads_back(tmp_path):
    found = constrained_samples(constants, dark, 2, 64, 16, seed=0)
    write_found(tmp_path / "x.h5", "diffuse", "rejection", found, 2, 1.5, 7)
    weights, attributes = read_found(tmp_path / "x.h5")
    assert torch.equal(weights, torch.from_numpy(found.weights))
    assert (attributes["category"], attributes["way"], attributes["wanted"]) == ("diffuse", "rejection", 2)
    assert (attributes["tried"], attributes["accepted"], attributes["kind"]) == (found.tried, found.accepted, "weights")
    assert attributes["message"] == summary("diffuse", found, 2)


def test_diffuse_and_metallic_constants():
    weights = torch.zeros(2, SIZE)
    weights[:, -3:] = torch.log1p(torch.tensor([[0.1], [0.4]]))
    assert InCategory("diffuse", RULES)(weights).tolist() == [True, False]
    assert InCategory("metallic", RULES)(weights).tolist() == [False, True]


def test_only_what_a_first_look_leaves_is_judged_on_all_entries(monkeypatch):
    weights = torch.zeros(3, SIZE)
    weights[:, -3:] = torch.log1p(torch.tensor([[0.1], [0.4], [0.5]]))
    inside = InCategory("diffuse", RULES)
    judged, statistics = [], inside.statistics
    monkeypatch.setattr(inside, "statistics", lambda w: judged.append(len(w)) or statistics(w))
    assert inside(weights).tolist() == [True, False, False]
    assert judged == [1]
    judged.clear()
    monkeypatch.setattr(inside, "look", lambda w: statistics(w).assign(exceeding=0))  # takes all for diffuse
    assert inside(weights).tolist() == [True, False, False]
    assert judged == [3]


@pytest.mark.parametrize(("name", "number"), [("n", 0), ("budget", 0), ("batch", -1)])
def test_numbers_are_checked(name, number):
    with pytest.raises(NeumatError, match=f"{name}: expected at least 1; found {number}"):
        constrained_samples(constants, dark, **{"n": 1, "budget": 1, "batch": 1, "seed": 0, name: number})


def test_mistakes_end_in_one_line(tmp_path):
    with pytest.raises(NeumatError, match="category"):
        InCategory("shiny", RULES)
    with pytest.raises(NeumatError, match=r"sampler: expected samples of shape \(4, 675\); found \(4, 3\)"):
        constrained_samples(lambda n, seed: np.zeros((n, 3)), dark, 1, 4, 4, seed=0)
    (tmp_path / "x.h5").write_text("no")
    with pytest.raises(NeumatError, match="a store of samples"):
        read_found(tmp_path / "x.h5")
