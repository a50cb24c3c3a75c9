"""The embedded 100 against witnesses that had no part in making them, or whose values are published.

Their fits to MERL by another model (SGD, Bagher et al. 2012) come with the package; the published NBRDFs, which they
were made from, lie beside a checkout of the project or not at all.
"""

import itertools
import math
from pathlib import Path

import pytest
import torch

from neumat.brdf.analytic import SGD
from neumat.brdf.coordinates import half_difference
from neumat.brdf.embedded import Embedded, embedded_names
from neumat.fields.distill import read_teachers
from neumat.fields.field import evaluate_inputs

NBRDFS = Path(__file__).parents[4] / "shared/data/nbrdf/merl_nbrdf.zip"
NAMES = embedded_names()
GRID = torch.meshgrid(torch.tensor([0.5, 1, 2, 5, 10, 20, 30, 40, 50, 60]), torch.arange(5.0, 60, 10), indexing="ij")
ANGLES = *(torch.deg2rad(angle.flatten()) for angle in GRID), torch.full((GRID[0].numel(),), math.pi / 2)
# Channels by the colour in the name: the brightest, the darkest. Not of greens, which are nearly as blue, nor purples.
BRIGHTEST = {"red": 0, "pink": 0, "orange": 0, "maroon": 0, "gold": 0, "blue": 2}
DARKEST = {"yellow": 2, "orange": 2, "gold": 2, "violet": 1, "magenta": 1}


@pytest.fixture(scope="module")
def values():
    """f of the 100 at ANGLES, (100, directions, 3), 1/sr; kept away from 0, of which there is no ratio."""
    return torch.stack([Embedded(i).eval(*ANGLES) for i in range(len(NAMES))]).double().clamp_min(1e-6)


@pytest.fixture(scope="module")
def fits():
    """The same of their fits by SGD."""
    return torch.stack([SGD.named(name).eval(*ANGLES) for name in NAMES]).double().clamp_min(1e-6)


def chroma(f):
    """Return (100, 3): how far each channel lies above the mean of the three, of mean logarithms."""
    logarithms = f.log().mean(1)
    return logarithms - logarithms.mean(1, keepdim=True)


def test_every_channel_is_as_bright_as_that_of_other_fits_of_the_same_measurements(values, fits):
    ratio = (values / fits).median(1).values
    torch.testing.assert_close(ratio.median(0).values, torch.ones(3).double(), atol=0.05, rtol=0)
    off = ((ratio < 0.74) | (ratio > 1.35)).any(1)
    assert off.sum() <= 20, [name for name, bad in zip(NAMES, off, strict=True) if bad]  # SGD misses 18, mostly metals


def test_channels_are_in_the_order_of_other_fits_of_the_same_measurements(values, fits):
    ours, theirs = chroma(values), chroma(fits)
    orders = [list(order) for order in itertools.permutations(range(3))]
    costs = torch.stack([(ours - theirs[:, order]).norm(dim=1) for order in orders], 1)
    coloured = theirs.amax(1) - theirs.amin(1) > 0.5
    assert coloured.sum() > 40
    # Two channels that are nearly equal may be told apart by either's noise.
    assert (costs[coloured, 0] <= costs[coloured].amin(1) + 0.1).all()


def test_colours_are_those_of_the_names(values):
    logarithms = values.log().mean(1)
    checked = 0
    for name, row in zip(NAMES, logarithms, strict=True):
        words = name.rstrip("0123456789").split("-")
        for table, sign in ((BRIGHTEST, 1), (DARKEST, -1)):
            for word in set(words) & table.keys():
                assert (sign * row).argmax() == table[word], name
                checked += 1
    assert checked > 25


@pytest.mark.skipif(not NBRDFS.is_file(), reason=f"needs the published NBRDFs, {NBRDFS.name}, beside the checkout")
def test_every_material_has_the_values_of_its_published_nbrdf(values):
    names, teachers = read_teachers(NBRDFS)
    assert names == NAMES
    inputs = half_difference(*ANGLES)
    published = torch.stack([evaluate_inputs(teachers[i : i + 1], inputs)[0] for i in range(len(names))]).double()
    off = (values.log1p() - published.log1p()).abs().mean((1, 2))
    ratio = (values / published.clamp_min(1e-6)).log().median(1).values
    assert off.max() < 0.02, names[off.argmax()]
    assert ratio.abs().max() < 0.1, names[ratio.abs().amax(1).argmax()]
