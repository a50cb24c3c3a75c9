import numpy as np
import pytest

from neumat.brdf.coordinates import above_horizon
from neumat.errors import NeumatError
from neumat.metrics.materials import MaterialSet, metric_entries, union


def test_metric_entries_are_stratified_and_seeded():
    valid = above_horizon().nonzero()[:, 0].numpy()
    chosen = metric_entries(valid, 512, seed=1).numpy()
    assert np.isin(chosen, valid).all() and (np.diff(chosen) > 0).all()
    # One in each run of V / 512 valid entries.
    runs = np.searchsorted(valid, chosen) * 512 // len(valid)
    assert np.abs(runs - np.arange(512)).max() <= 1
    assert (metric_entries(valid[::-1], 512, seed=1).numpy() == chosen).all()
    assert (metric_entries(valid, 512, seed=2).numpy() != chosen).any()
    for count in (0, len(valid) + 1):
        with pytest.raises(NeumatError):
            metric_entries(valid, count, seed=1)


def test_sets_that_do_not_belong_together_are_refused(make_set):
    a, b = make_set(2), make_set(3)
    assert len(union(a, b)) == 5
    with pytest.raises(NeumatError):
        union(a, b.thinned(2))
    with pytest.raises(NeumatError):
        MaterialSet(a.entries, a.brdf, a.images.float())
    with pytest.raises(NeumatError):
        MaterialSet(a.entries[:3], a.brdf, a.images)
