"""A fit that loses most of the light says so."""

import logging

import pytest
import torch

from neumat.btf.directions import random_pairs
from neumat.btf.representations.registry import make
from neumat.btf.store import BtfStore
from neumat.seeds import torch_generator


@pytest.fixture
def store():
    """Queries of a grey surface of 8 x 8 texels, which reflects .1 everywhere."""
    light, view = (each.view(32, 64, 3) for each in random_pairs(32 * 64, torch_generator(0, "pairs")))
    return BtfStore.from_arrays(torch.full((32, 8, 8, 3), 0.1), light, view)


def fitted(store):
    return make("ours", {"samples": 60_000, "side": 8}).fit(store, seed=0)


def test_brightness_is_that_of_the_store(store, caplog):
    model = fitted(store)
    assert model.brightness(store) == pytest.approx(1, abs=0.1)
    brighter = BtfStore.from_arrays(torch.full((32, 8, 8, 3), 0.2), store.light, store.view)
    assert model.brightness(brighter) == pytest.approx(model.brightness(store) / 2, rel=1e-3)
    assert not caplog.records


def test_lost_highlights_are_told(store, caplog):
    values = store.values(torch.arange(32)).clone()
    values[torch.rand(values.shape[:3], generator=torch_generator(0, "rare")) < 0.02] = 100.0
    with caplog.at_level(logging.WARNING):
        fitted(BtfStore.from_arrays(values, store.light, store.view))
    assert "times the captured brightness" in caplog.text


def test_pictures_have_one_pair_for_all_texels(store):
    pictures = BtfStore.from_arrays(
        store.values(torch.arange(32)), store.light[:, :1], store.view[:, :1], kind="pictures"
    )
    assert fitted(store).brightness(pictures) == pytest.approx(1, abs=0.1)
