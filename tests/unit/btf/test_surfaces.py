"""Surfaces: pure functions of position and seed, endless or exactly periodic, with the relief that they promise."""

from pathlib import Path

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.btf.surfaces.surface import PROCESSES, Surface
from neumat.config import load_surface

ROOT = Path(__file__).parents[3]
SCHEMA = ROOT / "workflow/schemas/btf.schema.json"
FILES = sorted((ROOT / "config/btf").glob("*.yaml"))
CONFIGS = {path.stem: load_surface(path, SCHEMA) for path in FILES}
TILEABLE = {name: Surface({**config, "tileable": True}) for name, config in CONFIGS.items()}
ENDLESS = {name: Surface(config) for name, config in CONFIGS.items()}
EXACT = 1 << 20  # u = k / EXACT: sums with integers below 1e9 are exact


def same(first, second):
    return all(torch.equal(a, b) for a, b in zip(first, second, strict=True))


@pytest.fixture
def u():
    return torch.rand(2000, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))


def test_there_is_a_surface_of_each_process():
    assert sorted(config["process"] for config in CONFIGS.values()) == sorted(PROCESSES)


@pytest.mark.parametrize("name", CONFIGS)
@settings(deadline=None, max_examples=20)
@given(
    st.lists(st.tuples(*[st.integers(-EXACT, 2 * EXACT)] * 2), min_size=1, max_size=20),
    st.tuples(*[st.integers(-(10**6), 10**6)] * 2),
)
def test_a_tileable_surface_repeats_to_the_last_bit(name, places, shift):
    u = torch.tensor(places).double() / EXACT
    assert same(TILEABLE[name].at(u), TILEABLE[name].at(u + torch.tensor(shift)))


@pytest.mark.parametrize("name", CONFIGS)
def test_any_order_and_size_of_the_batch(name, u):
    height, material = ENDLESS[name].at(u)
    order = torch.randperm(len(u), generator=torch.Generator().manual_seed(1))
    assert same(ENDLESS[name].at(u[order]), (height[order], material[order]))
    assert same(ENDLESS[name].at(u[7:8]), (height[7:8], material[7:8]))
