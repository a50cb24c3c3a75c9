"""Materials and directions that the tests of the BSDFs share."""

import math

import pytest
import torch

# Highlight: height, 1/sr, and fall of log(1 + f) with sin theta_h; from matte to mirror.
HIGHLIGHTS = {
    "black": (0.0, 1.0),
    "matte": (0.05, 1.0),
    "rough": (0.3, 2.0),
    "satin": (1.0, 5.0),
    "eggshell": (3.0, 10.0),
    "plastic": (8.0, 20.0),
    "waxed": (20.0, 40.0),
    "glossy": (50.0, 80.0),
    "lacquer": (100.0, 150.0),
    "polished": (300.0, 300.0),
    "steel": (1000.0, 700.0),
    "mirror": (3000.0, 1500.0),
}


@pytest.fixture
def ladder(field):
    """{name: weights (675,)} of materials from matte to mirror, coloured where they are diffuse."""
    return {
        name: field((0.2, 0.1, 0.05) if name != "black" else 0.01, peak, fall)
        for name, (peak, fall) in HIGHLIGHTS.items()
    }


@pytest.fixture
def view():
    """A direction (3,) by its polar angle and azimuth."""

    def make(theta, phi=0.7):
        return torch.tensor([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])

    return make
