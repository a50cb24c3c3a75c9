import pytest
import torch

from neumat.errors import NeumatError
from neumat.metrics.distances import DISTANCES
from neumat.metrics.materials import union
from neumat.metrics.near_copies import HELD_OUT, SAMPLES, novelty_summary
from neumat.metrics.novelty import novelty
from neumat.metrics.score import COLUMNS, score


def flat_features(images):
    return images.flatten(1).float()


def twice(images):
    return 2 * flat_features(images)


def test_one_row_for_each_metric_distance_and_draw(make_set):
    reference, samples = make_set(6), make_set(10, seed=1)
    samples.brdf[7, 0, 0] = torch.nan
    table = score(reference, samples, 2, "m", "p", {"flat": flat_features, "twice": twice})
    assert list(table.columns) == COLUMNS
    assert len(table) == 2 * (3 * len(DISTANCES) + 1 + 2 * 2)
    assert not table.duplicated(["draw", "metric", "distance"]).any()
    assert set(table.n_ref) == {6} and set(table.n_samples) == {5}
    values = table.set_index("metric").value
    assert values["Frechet-twice"].tolist() == pytest.approx((4 * values["Frechet-flat"]).tolist())
    assert not values["KID-twice"].equals(values["KID-flat"])
    assert table[table.metric == "nonfinite"].value.tolist() == [0, 1]
    percent = table[table.metric.isin(["cov", "one_nna"])].value
    assert percent.between(0, 100).all() and percent.max() > 1


def test_draws_are_scored_apart(make_set):
    reference = make_set(6)
    table = score(reference, union(make_set(6, seed=1), reference), 2, "m", "p", {})
    rmse = table[(table.metric == "mmd") & (table.distance == "rmse")].value.tolist()
    assert rmse[0] > 0 and rmse[1] == 0


def test_uneven_draws_are_refused(make_set):
    with pytest.raises(NeumatError, match="multiple of 3"):
        score(make_set(4), make_set(10), 3, "m", "p", {})


def test_copies_show_as_near_copies(make_set):
    training, held_out = make_set(40), make_set(20, seed=1)
    samples = union(training[:5], make_set(5, seed=2))
    rows = novelty(held_out.thinned(2), samples.thinned(2), training.thinned(2), "m", "p")
    copies = rows[(rows["set"] == SAMPLES) & (rows["item"] < 5)]
    assert (copies.value == 0).all() and (copies.nearest == copies["item"]).all()
    assert (rows[rows["set"] == HELD_OUT].value > 0).all()
    summary = novelty_summary(rows).set_index("distance")
    assert (summary.near_copies_percent >= 50).all() and (summary.n_samples == 10).all()


def test_a_broken_sample_is_no_near_copy(make_set):
    training, samples = make_set(10), make_set(2, seed=1)
    samples.brdf[0] = torch.nan
    rows = novelty(make_set(10, seed=2), samples, training, "m", "p")
    assert rows[(rows["set"] == SAMPLES) & (rows["item"] == 0)].value.tolist() == [torch.inf] * 2
