import pytest
import torch

from neumat.errors import NeumatError
from neumat.metrics.distances import DISTANCES
from neumat.metrics.materials import union
from neumat.metrics.score import COLUMNS, Scorer


def flat_features(images):
    return images.flatten(1).float()


def twice(images):
    return 2 * flat_features(images)


def test_one_row_for_each_metric_distance_and_draw(make_set):
    reference, samples = make_set(6), make_set(10, seed=1)
    samples.brdf[7, 0, 0] = torch.nan
    table = Scorer(reference, "p", 0, {"flat": flat_features, "twice": twice}).score(samples, 2, "m")
    assert list(table.columns) == COLUMNS
    assert len(table) == 2 * (3 * len(DISTANCES) + 1 + 2 * 2)
    assert not table.duplicated(["draw", "metric", "distance"]).any()
    assert set(table.n_ref) == {5} and set(table.n_samples) == {5}
    values = table.set_index("metric").value
    assert values["Frechet-twice"].tolist() == pytest.approx((4 * values["Frechet-flat"]).tolist())
    assert not values["KID-twice"].equals(values["KID-flat"])
    assert table[table.metric == "nonfinite"].value.tolist() == [0, 1]
    percent = table[table.metric.isin(["cov", "one_nna"])].value
    assert percent.between(0, 100).all() and percent.max() > 1


def test_draws_are_scored_apart(make_set):
    reference = make_set(6)
    table = Scorer(reference, "p", 0, {}).score(union(make_set(6, seed=1), reference), 2, "m")
    rmse = table[(table.metric == "mmd") & (table.distance == "rmse")].value.tolist()
    assert rmse[0] > 0 and rmse[1] == 0


@pytest.mark.parametrize(("n_ref", "size"), [(36, 120), (120, 36), (60, 60)])
def test_sets_from_one_distribution_are_not_told_apart_whatever_their_sizes(make_set, n_ref, size):
    draws = 8
    table = Scorer(make_set(n_ref), "p", 0, {}, ["brdf_l1_log"]).score(make_set(draws * size, seed=1), draws, "m")
    means = table.groupby("metric").value.mean()
    least = min(n_ref, size)
    assert set(table.n_ref) == set(table.n_samples) == {least}
    assert means["one_nna"] == pytest.approx(50, abs=5 if least < 60 else 4)
    # Of n samples each takes one of n references: a share of 1 - (1 - 1 / n)^n or less is taken.
    assert 40 < means["cov"] < 64


def test_all_methods_meet_the_same_references_and_each_draw_others(make_set):
    scorer = Scorer(make_set(30), "p", 0, {}, ["rmse"])
    first, second = (scorer._chosen(draw, 10).tolist() for draw in (0, 1))
    assert first == scorer._chosen(0, 10).tolist() != second and len(set(first)) == 10
    samples = make_set(20, seed=1)
    a, b = (scorer.score(samples, 2, name).drop(columns="method") for name in "ab")
    assert a.equals(b)


def test_psnr_has_the_neighbours_of_rmse(make_set):
    reference, samples = make_set(12), union(make_set(20, seed=1), make_set(12)[:4])
    both = Scorer(reference, "p", 0, {}).score(samples, 2, "m")
    # Alone it is computed by itself: the same numbers.
    alone = Scorer(reference, "p", 0, {}, ["neg_psnr"]).score(samples, 2, "m")
    for metric in ("cov", "one_nna"):
        values = [t[(t.metric == metric) & (t.distance == d)].value.tolist()
                  for t, d in ((both, "rmse"), (both, "neg_psnr"), (alone, "neg_psnr"))]  # fmt: skip
        assert values[0] == values[1] == values[2]


def test_uneven_draws_are_refused(make_set):
    with pytest.raises(NeumatError, match="multiple of 3"):
        Scorer(make_set(4), "p", 0, {}).score(make_set(10), 3, "m")
