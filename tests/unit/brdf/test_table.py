import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.brdf.coordinates import ENTRIES, GRID, above_horizon, cosines, grid_angles, grid_axes
from neumat.brdf.table import Table, valid_entries
from neumat.seeds import torch_generator


@pytest.fixture(scope="module")
def random_table():
    values = torch.rand(ENTRIES, 3, generator=torch_generator(0, "table"))
    values[~above_horizon()] = math.nan
    return Table(values), values


def test_grid_entries_come_back(random_table):
    table, values = random_table
    entries = above_horizon().nonzero()[::97, 0]
    torch.testing.assert_close(table.eval(*grid_angles(entries)), values[entries], atol=2e-4, rtol=0)


def test_linear_functions_of_the_grid_position_are_exact():
    h, d, p = torch.meshgrid(*(torch.arange(n, dtype=torch.float32) for n in GRID), indexing="ij")
    table = Table(torch.stack([h, d, p], dim=-1).reshape(-1, 3))
    position = torch.tensor([[3.25, 10.5, 20.75], [10.0, 0.5, 178.5], [0.0, 40.25, 0.25]])
    theta_h = (position[:, 0] / 90) ** 2 * math.pi / 2
    found = table.eval(theta_h, position[:, 1] / 90 * math.pi / 2, position[:, 2] / 180 * math.pi)
    torch.testing.assert_close(found, position, atol=1e-3, rtol=1e-5)


@settings(max_examples=50)
@given(st.floats(0, math.pi / 2), st.floats(0, math.pi / 2), st.floats(0, math.pi))
def test_reciprocal_bounded_and_dark_below_the_horizon(random_table, theta_h, theta_d, phi_d):
    table, _ = random_table
    angles = torch.tensor([[theta_h], [theta_d], [phi_d]])
    value = table.eval(*angles)
    swapped = table.eval(angles[0], angles[1], angles[2] + math.pi)
    # Near-coincident wraps and cell borders move by rounding, steps of the random table being at most 1.
    torch.testing.assert_close(value, swapped, atol=1e-3, rtol=0)
    assert ((value >= 0) & (value <= 1 + 1e-6)).all()
    if min(c.item() for c in cosines(*angles)) < -1e-5:
        assert (value == 0).all()


def test_phi_d_wraps_from_the_last_column_to_the_first():
    values = torch.zeros((*GRID, 3))
    values[:, :, 0] = 1.0
    halfway = torch.tensor([179.5 / 180 * math.pi])
    table = Table(values.reshape(-1, 3))
    found = table.eval(torch.tensor([0.1]), torch.tensor([0.2]), halfway)
    torch.testing.assert_close(found, torch.full((1, 3), 0.5), atol=1e-4, rtol=0)


def test_invalid_corners_are_left_out():
    values = torch.full((*GRID, 3), 2.0)
    values[10:, :, :, 1] = math.nan  # one channel is enough; the horizon is far from these angles
    table = Table(values.reshape(-1, 3))
    theta_h = grid_axes()[0].float()
    between = (theta_h[9] + theta_h[10]) / 2
    angle = torch.tensor([0.3, 0.3])
    found = table.eval(torch.stack([between, theta_h[40]]), angle, angle)
    torch.testing.assert_close(found, torch.tensor([[2.0] * 3, [0.0] * 3]))


@pytest.mark.parametrize("kind", [torch.from_numpy, lambda values: values])
def test_an_entry_is_valid_above_the_horizon_where_it_is_finite_and_not_negative(kind):
    up = above_horizon().numpy()
    assert up.mean() == pytest.approx(0.762, abs=5e-4)
    values = np.ones((ENTRIES, 3), np.float32)
    broken = np.flatnonzero(up)[::1000][:4]
    values[broken, [0, 1, 2, 0]] = [np.nan, np.inf, -1e-30, -np.inf]
    expected = up.copy()
    expected[broken] = False
    found = valid_entries(kind(values))
    np.testing.assert_array_equal(np.asarray(found), expected)
    assert type(found) is type(kind(values))


def test_what_a_table_holds_below_the_horizon_changes_nothing():
    values = torch.rand(ENTRIES, 3, generator=torch_generator(1, "table"))
    angles = torch.rand(3, 2000, generator=torch_generator(2, "angles")) * math.pi / 2
    expected = Table(torch.where(above_horizon()[:, None], values, math.nan)).eval(*angles)
    for below in (0.0, -1.0, 1e5, math.inf, math.nan):
        found = Table(torch.where(above_horizon()[:, None], values, below)).eval(*angles)
        assert torch.equal(found, expected)


def test_wrong_shape():
    with pytest.raises(ValueError, match="1458000"):
        Table(torch.zeros(5, 3))
