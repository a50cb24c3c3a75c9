import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from neumat.brdf.analytic import GGX, Lambert
from neumat.brdf.coordinates import ENTRIES, grid_angles, grid_axes
from neumat.brdf.statistics import (
    LINE,
    half_width,
    material_statistics,
    source_statistics,
    split,
    statistics,
    valid_entries,
)
from neumat.errors import NeumatError

THETA_H = grid_axes()[0].float()


def test_lambert():
    row = material_statistics(Lambert([0.5, 0.2, 0.1])).iloc[0]
    assert row["entries"] == len(valid_entries()) and row["exceeding"] == 0
    assert row[["minimum", "maximum", "peak", "mean_r"]].to_numpy(float) == pytest.approx(0.5 / math.pi)
    assert row["half_width"] == pytest.approx(math.pi / 2)
    assert row["mean_b"] == pytest.approx(0.1 / math.pi) and row["difference"] == 0


def test_two_entries_by_hand():
    inner = torch.tensor([[[0.1, 2.0], [0.2, 1.5], [0.05, 1.9]]])
    grazing = torch.tensor([[[10.0], [4.0], [0.0]]])
    row = statistics(1, [inner], [grazing], torch.ones(1, 3, 90)).iloc[0]
    assert (row["entries"], row["exceeding"], row["inner_entries"], row["inner_exceeding"]) == (3, 2, 2, 1)
    assert (row["minimum"], row["maximum"], row["inner_maximum"]) == pytest.approx((0.2, 10, 2))
    assert (row["difference"], row["inner_difference"]) == pytest.approx((10, 0.5))
    assert (row["relative_difference"], row["inner_relative_difference"]) == pytest.approx((1, 0.25))
    assert row[["mean_r", "mean_g", "maximum_b"]].to_numpy(float) == pytest.approx([12.1 / 3, 5.7 / 3, 1.9])


@pytest.mark.parametrize("width", [0.01, 0.1, 0.7])
def test_half_width_of_a_known_lobe(width):
    lobe = 7 * torch.exp(-math.log(2) * (THETA_H / width) ** 2)
    assert half_width(lobe[None]).item() == pytest.approx(width, rel=0.01)


def test_half_width_of_ggx():
    # For small angles D falls to half at alpha sqrt(sqrt 2 - 1), and shadowing hardly changes.
    row = material_statistics(GGX(0.05, 0.9)).iloc[0]
    assert row["half_width"] == pytest.approx(0.05 * math.sqrt(math.sqrt(2) - 1), rel=0.01)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (torch.full((90,), 3.0), math.pi / 2),  # never falls
        (torch.zeros(90), math.pi / 2),  # no lobe at all
        (torch.cat([torch.ones(1), torch.zeros(89)]), THETA_H[1].item() / 2),  # falls at once: linear
        (1 + THETA_H, math.pi / 2),  # rises
    ],
)
def test_half_width_where_there_is_no_lobe(line, expected):
    assert half_width(line[None]).item() == pytest.approx(expected)


def test_order_of_the_channels_does_not_count():
    values = torch.rand(1, 3, 64) * 2
    line = torch.rand(1, 3, 90)
    one, other = (statistics(1, [values[:, p]], [], line[:, p]) for p in ([0, 1, 2], [2, 0, 1]))
    same = [name for name in one if name[-2:] not in ("_r", "_g", "_b")]
    assert one[same].equals(other[same])


def test_every_valid_entry_is_on_one_side_of_the_split():
    entries = valid_entries()
    parts = split(entries)
    assert torch.cat(parts).sort().values.equal(torch.arange(len(entries)))
    assert torch.isin(LINE, entries).all()


def test_a_source_gives_what_its_material_gives():
    entries, material = valid_entries(), GGX(0.2, [0.9, 0.5, 0.2])
    table = material.eval(*grid_angles(entries)).numpy()
    store = SimpleNamespace(entries=entries.numpy(), n=1, names=["x"], table=lambda i: table)
    found, expected = source_statistics(store).drop(columns="name"), material_statistics(material)
    np.testing.assert_allclose(found.to_numpy(float), expected.to_numpy(float), rtol=1e-5)
    gap = SimpleNamespace(entries=np.arange(1, ENTRIES), n=1, names=["x"], table=None)
    with pytest.raises(NeumatError, match="theta_d = phi_d = 0"):
        source_statistics(gap)
