"""What all tests share."""

import pytest

from neumat.render.mitsuba_scene import variant


@pytest.fixture(scope="session", autouse=True)
def llvm():
    """Choose LLVM's library before any test imports mitsuba, which then keeps the one it found first."""
    return variant()
