"""Each statistic must tell the fault that it is there for, on textures of which endless truths are known."""

import math

import pytest
import torch

from neumat.errors import NeumatError
from neumat.metrics.seams import compare_seams, seams
from neumat.metrics.textures import STATISTICS, Truth, autocorrelation
from neumat.seeds import torch_generator

EXEMPLAR, SIDE = 48, 144
QUICK = [name for name in STATISTICS if name != "frechet"]


def noise(seed, size=SIDE, period=None):
    """Smooth noise, coloured, in [0, 1]; with `period` it repeats after so many pixels."""
    size = period or size
    field = torch.rand(size + 16, size + 16, 3, generator=torch_generator(seed, "noise"))
    if period:
        field = field[:size, :size]
    for axis in (0, 1):
        field = sum(field.roll(shift, axis) for shift in range(3)) / 3
    field = (field if period else field[8:-8, 8:-8]) @ torch.tensor([[0.8, 0.5, 0.3], [0.1, 0.4, 0.2], [0.0, 0.0, 0.4]])
    return field if period is None else field.repeat(-(-SIDE // size), -(-SIDE // size), 1)[:SIDE, :SIDE]


def bricks(seed, shift=0):
    """An offset lattice of bricks, each of its own tone, on mortar."""
    y, x = torch.meshgrid(torch.arange(SIDE) + shift, torch.arange(SIDE) + 2 * shift, indexing="ij")
    row = y // 8
    column = (x + 8 * (row % 2)) // 16
    tones = torch.rand(64, 64, 3, generator=torch_generator(seed, "bricks")) * 0.5 + 0.3
    mortar = (y % 8 < 2) | ((x + 8 * (row % 2)) % 16 < 2)
    return torch.where(mortar[..., None], torch.tensor(0.1), tones[row, column])


CROPS = [noise(k) for k in range(3)]
WALLS = [bricks(k, 5 * k) for k in range(3)]


def ratios(picture, crops, *names):
    return {name: value.ratio for name, value in Truth(crops, EXEMPLAR, names).compare(picture).items()}


def test_another_crop_of_the_truth_is_within_the_crops_scatter():
    for picture, crops in ((noise(9), CROPS), (bricks(9, 3), WALLS)):
        for name, value in Truth(crops, EXEMPLAR, QUICK).compare(picture).items():
            assert abs(value.value - value.truth) <= 5 * value.scatter + 0.3 * value.truth, name


def test_plain_tiling_repeats():
    found = Truth(CROPS, EXEMPLAR, ["repetition", "copies"]).compare(noise(9, period=EXEMPLAR))
    value = found["repetition"]
    assert value.value > value.truth + 10 * value.scatter
    assert found["copies"].value == 1 and found["copies"].truth < 0.2


def test_copies_are_counted_in_structure_too():
    one = bricks(9)[:EXEMPLAR, :EXEMPLAR].repeat(3, 3, 1)
    assert Truth(WALLS, EXEMPLAR, ["copies"]).compare(one)["copies"].value == 1


def test_shuffled_texels_fail_the_spectrum_and_pass_the_histogram():
    picture = noise(9)
    order = torch.randperm(SIDE * SIDE, generator=torch_generator(3))
    shuffled = picture.flatten(0, 1)[order].reshape(picture.shape)
    found = ratios(shuffled, CROPS, "spectrum", "histogram", "ghosts")
    assert found["spectrum"] > 3 and found["ghosts"] > 1.1
    assert found["histogram"] < 1.3


def test_blending_by_means_fails_the_histograms():
    blended = (noise(8) + noise(9) + noise(10)) / 3
    found = ratios(blended, CROPS, "histogram", "colours", "spectrum")
    assert found["histogram"] > 2 and found["colours"] > 2 and found["spectrum"] > 2


def test_broken_structure_fails_the_autocovariance_and_makes_ghosts():
    blended = torch.maximum(bricks(8), bricks(9, 4))
    found = ratios(blended, WALLS, "autocovariance", "ghosts")
    assert found["autocovariance"] > 3 and found["ghosts"] > 1.3


def test_a_picture_that_lacks_what_the_truth_has_fails_coverage():
    plain = torch.where(noise(9) > 0.6, torch.tensor(0.5), noise(9) * 0.5)
    assert ratios(plain, CROPS, "coverage")["coverage"] > 1.3


def test_hard_borders_are_seams():
    smooth = noise(9)
    for axis in (0, 1):
        smooth = sum(smooth.roll(shift, axis) for shift in range(5)) / 5
    borders = list(range(EXEMPLAR, SIDE, EXEMPLAR))
    tiles = [torch.cat([smooth.roll(17 * (3 * i + j), 1)[:EXEMPLAR, :EXEMPLAR] for j in range(3)], 1) for i in range(3)]
    assert 0.8 < seams(smooth, borders, borders) < 1.3
    assert seams(torch.cat(tiles), borders, borders) > 2


@pytest.mark.parametrize(("crops", "own"), [(CROPS, noise(9)), (WALLS, bricks(9, 3))], ids=["noise", "bricks"])
def test_hard_borders_are_told_from_what_the_truth_has_there(crops, own):
    """Also in a texture that has straight lines of its own."""
    blocks = [[own.roll((11 * i + 5 * j, 17 * j + 3 * i), (0, 1))[:36, :36] for j in range(4)] for i in range(4)]
    hard, borders = torch.cat([torch.cat(row, 1) for row in blocks]), [36, 72, 108]
    found = compare_seams(hard, crops, borders, borders)
    assert found.value > found.truth + 3 * found.scatter
    found = compare_seams(own, crops, borders, borders)
    assert abs(found.value - found.truth) < 3 * found.scatter


def test_autocorrelation_of_a_wave():
    x = torch.arange(64) * (2 * math.pi / 8)
    found = autocorrelation(torch.sin(x).expand(2, 1, 64, 64), 8)
    assert torch.allclose(found[:, 8], torch.cos(torch.arange(-8, 9) * (2 * math.pi / 8)).double(), atol=0.02)
    assert torch.allclose(found[:, :, 8], torch.ones(1, dtype=torch.float64), atol=0.02)


@pytest.mark.parametrize("name", QUICK)
def test_constant_pictures_have_finite_statistics(name):
    grey = torch.full((SIDE, SIDE, 3), 0.3)
    value = Truth([grey.clone(), grey.clone()], EXEMPLAR, [name]).compare(grey)[name]
    assert math.isfinite(value.value) and (value.ratio == 1 or name == "copies")
    assert math.isfinite(Truth(CROPS, EXEMPLAR, [name]).compare(grey)[name].value)


def test_the_same_picture_gives_the_same_numbers():
    first, again = (Truth(CROPS, EXEMPLAR, QUICK).compare(noise(9)) for _ in range(2))
    assert first == again


def test_features_of_a_pretrained_network_tell_noise_from_bricks():
    pytest.importorskip("efficientnet_lite_pytorch")
    found = Truth([bricks(1), bricks(2)], EXEMPLAR, ["frechet"]).compare(noise(9))["frechet"]
    assert found.ratio > 2


@pytest.mark.parametrize(
    "picture, crops",
    [(CROPS[0], CROPS[:1]), (CROPS[0][:100], CROPS), (torch.zeros(60, 60, 3), [torch.zeros(60, 60, 3)] * 2)],
)
def test_pictures_of_other_sizes_are_refused(picture, crops):
    with pytest.raises(NeumatError, match="crops"):
        Truth(crops, EXEMPLAR).compare(picture)
