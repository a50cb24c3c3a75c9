import math

import torch

from neumat.btf.directions import random_pairs
from neumat.btf.store import BtfStore
from neumat.seeds import torch_generator
from neumat.studies.btf_fit_bench import fit_bench


def test_both_ways_are_timed_at_equal_samples():
    generator = torch_generator(0, "bench")
    light, view = (each.view(8, 64, 3) for each in random_pairs(8 * 64, generator))
    values = (light[:, :, 2:] / math.pi).repeat(1, 4, 3).view(8, 16, 16, 3)
    store = BtfStore.from_arrays(values, light, view)
    held = BtfStore.from_arrays(values[:2], light[:2, :1], view[:2, :1], kind="pictures")
    found = fit_bench(store, held, {"samples": 1 << 16, "side": 4}, seed=0, rounds=1)
    assert found["method"].tolist() == ["naive", "ours"]
    assert (found["samples"] == 1 << 16).all()
    assert torch.tensor(found[["cpu_seconds", "samples_per_second", "loss"]].to_numpy()).isfinite().all()
