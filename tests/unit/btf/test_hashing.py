"""Hashes of cells: the same bits everywhere, and as good as random."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from neumat.btf.hashing import hashed, hashed_integers

MASK = 0xFFFFFFFF
INTEGERS = st.integers(-(2**62), 2**62)


def by_hand(cell, seed, channel):
    """The hash in plain Python integers, as a shader would write it."""

    def mix(x):
        x ^= x >> 16
        x = x * 0x7FEB352D % 2**32
        x ^= x >> 15
        x = x * 0x846CA68B % 2**32
        return x ^ (x >> 16)

    key = 0
    for part in (seed % 2**32, (seed >> 32) % 2**32, channel):
        key = mix((key + part) % 2**32)
    state = key
    for coordinate in cell:
        state = mix((state + coordinate) % 2**32) ^ key
    return state


@given(st.lists(INTEGERS, min_size=1, max_size=3), INTEGERS, st.integers(0, 100))
def test_the_bits_are_those_of_plain_integers(cell, seed, channel):
    assert hashed_integers(torch.tensor(cell), seed, channel).item() == by_hand(cell, seed, channel)


def grid(n):
    at = torch.arange(-n // 2, n // 2)
    return torch.cartesian_prod(at, at)


def test_values_are_uniform_and_those_of_different_cells_independent():
    values = hashed(grid(300), 3).reshape(300, 300)
    assert 0 <= values.min() and values.max() < 1
    counts = torch.histc(values, 100, 0, 1)
    assert ((counts - 900) ** 2 / 900).sum() < 150  # chi-square with 99 degrees of freedom: 3.6 sigma
    for part in (values, (values * 2**16) % 1):  # the high bits, the low ones
        white = (part - part.mean()) / part.std()
        correlations = torch.fft.ifft2(torch.fft.fft2(white).abs() ** 2).real / 300**2
        correlations[0, 0] = 0
        assert correlations.abs().max() < 6 / 300  # at any shift: 6 sigma


@pytest.mark.parametrize("other", [{"seed": 1}, {"seed": 1 << 40}, {"channel": 1}])
def test_seeds_and_channels_give_other_values(other):
    first = hashed(grid(200), 0)
    second = hashed(grid(200), **{"seed": 0, **other})
    assert abs(((first - 0.5) * (second - 0.5)).mean() * 12) < 4 / 200


def test_any_order_and_size_of_the_batch():
    cells = grid(20)
    order = torch.randperm(400, generator=torch.Generator().manual_seed(0))
    assert torch.equal(hashed(cells[order], 5), hashed(cells, 5)[order])
    assert torch.equal(hashed(cells[7:8], 5), hashed(cells, 5)[7:8])
