"""Small surfaces of known shape."""

import math
from dataclasses import dataclass, field

import pytest
import torch


@dataclass
class Shape:
    """A surface by its functions of x and y, float64 (n,)."""

    height: object = lambda x, y: 0 * x
    material: object = lambda x, y: 0 * x
    materials: tuple = ("white-paint",)
    tileable: bool = True
    size_mm: float = 10.0
    config: dict = field(default_factory=lambda: {"name": "shape"})

    def at(self, u):
        return self.height(*u.unbind(1)), self.material(*u.unbind(1)).long()

    def infinite(self):
        return self


@pytest.fixture(scope="session")
def shape():
    """Return the class Shape."""
    return Shape


@pytest.fixture(scope="session")
def waves():
    """Return a tileable surface of waves, of two materials."""
    turn = 2 * math.pi
    return Shape(
        lambda x, y: 0.02 * torch.sin(2 * turn * x) * torch.sin(turn * y),
        lambda x, y: torch.sin(turn * (x + y)) > 0,
        ("white-paint", "gold-paint"),
    )
