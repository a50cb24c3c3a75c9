import math

import pytest
import torch

from neumat.btf.directions import random_pairs
from neumat.btf.store import BtfStore
from neumat.seeds import torch_generator
from neumat.studies.btf_fit_bench import SHORTEST, fit_bench, seconds_to_loss


def test_both_ways_are_timed_at_equal_samples():
    generator = torch_generator(0, "bench")
    light, view = (each.view(8, 64, 3) for each in random_pairs(8 * 64, generator))
    values = (light[:, :, 2:] / math.pi).repeat(1, 4, 3).view(8, 16, 16, 3)
    store = BtfStore.from_arrays(values, light, view)
    held = BtfStore.from_arrays(values[:2], light[:2, :1], view[:2, :1], kind="pictures")
    found = fit_bench(store, held, {"samples": 1 << 16, "side": 4}, seed=0, rounds=1)
    assert found["method"].tolist() == ["naive", "ours"]
    assert (found["samples"] == 1 << 16).all()
    assert found["equal_loss_seconds"][0] == found["cpu_seconds"][0]
    assert not found["equal_loss_seconds"][1] > found["cpu_seconds"][1]
    assert torch.tensor(found[["cpu_seconds", "samples_per_second", "loss"]].to_numpy()).isfinite().all()


@pytest.mark.parametrize(("loss", "seconds"), [(1 / 48, 6.0), (1 / 64, 8.0), (1 / 32, 4.0), (1 / 65, math.nan)])
def test_time_to_a_loss_is_interpolated_between_whole_fits(loss, seconds):
    """A fit of n samples takes n / 8 s and has a loss of 1 / n."""

    def fit(samples):
        return samples / 8, 1 / samples, samples

    found = seconds_to_loss(fit, fit(64), loss)
    assert math.isnan(seconds) == math.isnan(found)
    assert math.isnan(seconds) or abs(math.log2(found / seconds)) < 0.1


def test_time_to_a_loss_that_any_fit_reaches_is_that_of_the_shortest():
    assert seconds_to_loss(lambda samples: (samples, 0.0, samples), (1024, 0.0, 1024), 1.0) == 1024 / 2**SHORTEST
