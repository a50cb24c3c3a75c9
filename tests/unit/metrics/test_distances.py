from dataclasses import replace

import numpy as np
import pytest
import torch
from skimage.metrics import structural_similarity

from neumat.brdf.coordinates import cosines, grid_angles
from neumat.metrics.distances import DISTANCES, Comparison, between, distance_tables
from neumat.metrics.ssim import ssim_tables

WHOLE = [(slice(None), slice(None))]


def distance_table(name, materials):
    """All materials with all others."""
    return distance_tables(name, Comparison(materials, WHOLE))[0]


def expected(name, a, b):
    """One distance of two materials, straight from its definition in float64."""
    f, g = (m.brdf[0].double().numpy() for m in (a, b))
    x, y = (m.images[0].double().numpy() / 255 for m in (a, b))
    cos = cosines(*grid_angles(a.entries))[0].clamp_min(0).double().numpy()[:, None]
    mse = ((x - y) ** 2).mean()
    return {
        "brdf_l1": lambda: np.abs(f - g).mean(),
        "brdf_l1_log": lambda: np.abs(np.log1p(f) - np.log1p(g)).mean(),
        "msl": lambda: ((np.log1p(f * cos) - np.log1p(g * cos)) ** 2).mean(),
        "rmse": lambda: np.sqrt(mse),
        "neg_psnr": lambda: 10 * np.log10(mse),
    }[name]()


@pytest.mark.parametrize("name", ["brdf_l1", "brdf_l1_log", "msl", "rmse", "neg_psnr"])
def test_definition(make_set, name):
    materials = make_set(5)
    table = distance_table(name, materials)
    for i, j in [(0, 1), (4, 2), (3, 1)]:
        want = expected(name, materials[i : i + 1], materials[j : j + 1])
        assert table[i, j].item() == pytest.approx(want, rel=1e-5)


@pytest.mark.parametrize("name", DISTANCES)
def test_table_is_symmetric_and_copies_are_nearest(make_set, name):
    materials = make_set(70)
    materials = materials[torch.tensor([*range(70), 3])]
    table = distance_table(name, materials)
    assert torch.equal(table, table.T)
    assert torch.allclose(table[70], table[3], atol=1e-6, rtol=0)
    others = table[3].clone()
    others[[3, 70]] = torch.inf
    assert table[3, 70] < others.min()
    assert table[3, 70] == pytest.approx({"neg_ssim": -1, "neg_psnr": table[3, 3].item()}.get(name, 0), abs=1e-6)


def test_equal_pictures_are_exactly_equal(make_set):
    materials = make_set(3, size=256)
    materials = materials[torch.tensor([0, 1, 2, 0])]
    assert distance_table("rmse", materials)[0, 3] == 0
    assert distance_table("neg_psnr", materials)[0, 3].item() == pytest.approx(-107.087, abs=1e-3)
    one_level = materials.images[:1].clone()
    one_level[0, 0, 0, 0] += 1
    nearly = replace(materials[:2], images=torch.cat([materials.images[:1], one_level]))
    assert -107 < distance_table("neg_psnr", nearly)[0, 1].item() < -101


def test_one_broken_value_breaks_every_distance_of_the_material(make_set):
    materials = make_set(4)
    materials.brdf[2, 5, 1] = torch.inf
    for name in DISTANCES:
        broken = distance_table(name, materials).isnan()
        assert broken[2].all() and broken[:, 2].all() and broken.sum() == 7


@pytest.mark.parametrize("name", DISTANCES)
def test_blocks_are_parts_of_the_whole_table(make_set, name):
    materials = make_set(140)  # more than one tile
    few, rest = slice(0, 10), slice(10, 140)
    whole = distance_table(name, materials)
    tables = distance_tables(name, Comparison(materials, [(few, rest), (rest, rest)]))
    assert torch.equal(tables[1], tables[1].T)
    for table, expected in zip(tables, (whole[few, rest], whole[rest, rest]), strict=True):
        assert torch.allclose(table, expected, rtol=1e-6, atol=1e-7)
    assert torch.equal(between(name, materials[few], materials[rest]), tables[0])


@pytest.mark.parametrize("window", [3, 7])
def test_ssim_equals_skimage(make_set, window):
    images = make_set(6, size=32).images
    table = ssim_tables(images, WHOLE, window, step=1)[0]
    for i, j in [(0, 1), (5, 2), (3, 4)]:
        pair = images[i].numpy(), images[j].numpy()
        want = structural_similarity(*pair, win_size=window, channel_axis=-1, data_range=255)
        assert table[i, j].item() == pytest.approx(want, abs=1e-6)


def test_sampled_ssim_is_near_the_exact_one():
    grid = torch.linspace(-1, 1, 128)
    y, x = torch.meshgrid(grid, grid, indexing="ij")
    disc = torch.hypot(x, y) < 0.8
    sharpness = torch.logspace(0, 2, 12)
    shaded = torch.exp(-sharpness[:, None, None] * ((x - 0.2) ** 2 + (y + 0.3) ** 2))
    images = torch.where(disc, shaded * 200 + 20, 60.0).byte()[..., None].repeat(1, 1, 1, 3)
    (exact,), (sampled,) = ssim_tables(images, WHOLE, step=1), ssim_tables(images, WHOLE)
    assert (exact - sampled).abs().max() < 5e-3
    (same,) = ssim_tables(images[:1].repeat(3, 1, 1, 1), WHOLE)
    assert torch.equal(same, torch.ones(3, 3, dtype=torch.float64))
