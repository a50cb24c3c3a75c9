"""What all tests share."""

import math

import pytest
import torch
from hypothesis import settings

from neumat.fields.layout import SIZE, unpack
from neumat.render.variant import variant
from neumat.stability.stress import COLUMNS

settings.register_profile("shared", deadline=None)  # other programs may stop a test at any time
settings.load_profile("shared")


@pytest.fixture(scope="session", autouse=True)
def llvm():
    """Choose LLVM's library before any test imports mitsuba, which then keeps the one it found first."""
    return variant()


@pytest.fixture(scope="session")
def compiled():
    """Skip where Mitsuba runs Python per sample."""
    if variant() == "scalar_rgb":
        pytest.skip("needs a compiled Mitsuba variant: neither CUDA nor a working LLVM library was found")


@pytest.fixture(scope="session")
def check_stresses():
    """Assert what holds of every table of stresses: all as expected, in words, and without a path."""

    def check(table):
        assert list(table.columns) == COLUMNS and table["stress"].is_unique
        assert table["ok"].all(), table[~table["ok"]].to_string()
        assert (table["expected"].str.len() > 0).all() and (table["found"].str.len() > 0).all()
        assert not table["found"].str.contains("\n|/tmp").any()

    return check


@pytest.fixture(scope="session")
def field():
    def make(albedo=0.0, peak=0.0, fall=100.0):
        """Weights (675,) with f = albedo / pi + a highlight, log(1 + f) falling linearly by `fall` times sin theta_h.

        albedo: a number or one per channel. peak: f at theta_h = 0, 1/sr, the same in all channels.
        """
        weights = torch.zeros(SIZE)
        (w1, b1), (w2, _), (w3, b3) = unpack(weights)
        b3[:] = torch.log1p(torch.as_tensor(albedo) / math.pi)
        w1[0, 0], b1[0], w2[0, 0], w3[0] = -fall, math.log1p(peak), 1.0, 1.0
        return weights

    return make
