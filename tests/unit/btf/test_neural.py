"""What neural representations do beyond the contract: retries, and stores larger than memory."""

import math

import pytest
import torch

from neumat.btf.directions import random_pairs
from neumat.btf.representations import batches, neural, training
from neumat.btf.representations.variants import Mean, Ours, means
from neumat.btf.store import BtfStore
from neumat.errors import NeumatError
from neumat.seeds import torch_generator

QUICK = {"samples": 20_000, "side": 4}


@pytest.fixture(scope="module")
def store():
    """Twelve sweeps of 8 x 8 texels; each value tells its sweep, texel and channel."""
    light, view = (each.view(12, 16, 3) for each in random_pairs(12 * 16, torch_generator(0, "directions")))
    values = torch.arange(12 * 64 * 3).view(12, 8, 8, 3) / 1024
    return BtfStore.from_arrays(values, light, view)


def test_a_fit_that_fails_is_tried_again_at_lower_rates(store, monkeypatch):
    rates = []

    def train(config, *rest):
        plane, angular, layers = training.train(config, *rest)
        rates.append(config.rate)
        if len(rates) == 1:
            layers[-1] = layers[-1] * math.nan
        return plane, angular, layers

    monkeypatch.setattr(neural, "train", train)
    fitted = Ours(rate=0.1, **QUICK).fit(store, seed=0)
    assert rates[:2] == [0.1, 0.1 / 4]
    assert fitted.rate == 0.1
    assert all(tensor.isfinite().all() for tensor in fitted.state.values())


def test_a_fit_that_always_fails_is_refused(store):
    with pytest.raises(NeumatError, match="finite numbers"):
        Mean(rate=1e30, samples=20_000, side=4).fit(store, seed=0)


@pytest.mark.parametrize("memory", [1 << 30, 5 * 6 * 64])
def test_every_sweep_is_seen_once_an_epoch_with_its_directions(store, monkeypatch, memory):
    monkeypatch.setattr(batches, "MEMORY", memory)
    source = batches.batches(store, lambda values: values, torch_generator(0, "batches"))
    for _ in range(2):
        seen = []
        for light, view, target in (next(source) for _ in range(12)):
            sweep = round((target[0, 0, 0] * 1024).item() / 192)
            seen.append(sweep)
            assert torch.equal(light, store.light[sweep]) and torch.equal(view, store.view[sweep])
            expected = store.values([sweep])[0].float().view(4, 16, 3).permute(2, 0, 1)
            assert torch.equal(target, expected)
        assert sorted(seen) == list(range(12))


def test_texels_of_pictures_see_the_picture_of_their_pair(store):
    pictures = BtfStore.from_arrays(
        store.values(torch.arange(12)), store.light[:, :1], store.view[:, :1], kind="pictures"
    )
    light, view, target = next(batches.batches(pictures, lambda values: values, torch_generator(0, "batches")))
    rows, pairs = batches.rows_of_pairs(pictures)
    assert (rows, pairs) == (1, 64)
    for q in range(pairs):
        sweep = (pictures.light[:, 0] == light[q]).all(1).nonzero().item()
        assert torch.equal(view[q], pictures.view[sweep, 0])
        assert torch.equal(target[:, 0, q], pictures.values([sweep])[0].float().view(64, 3)[q])


def test_means_are_taken_over_the_texels_of_a_pair(store):
    found = means(store)
    assert (found.height, found.width, found.pairs, found.sweeps) == (1, 192, 192, 1)
    expected = store.values(torch.arange(12)).float().view(12, 4, 16, 3).mean(1).view(1, 1, 192, 3)
    assert torch.allclose(found.values([0]).float(), expected, rtol=1e-3)
    assert torch.equal(found.light, store.light.view(1, 192, 3))
