from types import SimpleNamespace

import numpy as np
import pytest
import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.brdf.statistics import material_statistics
from neumat.fields.field import Field
from neumat.fields.layout import SIZE, permute_channels
from neumat.fields.statistics import FieldStatistics, neumerl_statistics


@pytest.fixture(scope="module")
def weights():
    return 0.3 * torch.randn(2, SIZE, generator=torch.Generator().manual_seed(3))


def test_a_field_gives_what_its_material_gives(weights):
    found = FieldStatistics()(weights)
    for i, row in enumerate(weights):
        expected = material_statistics(Field(row)).iloc[0]
        # Values within rounding of the threshold count on either side.
        assert abs(found["exceeding"][i] - expected["exceeding"]) <= 10
        same = [name for name in found if not name.endswith("exceeding")]
        np.testing.assert_allclose(
            found.loc[i, same].to_numpy(float), expected[same].to_numpy(float), rtol=1e-3, atol=1e-5
        )


def test_a_look_at_some_entries_counts_as_many_as_all(weights):
    some, every = FieldStatistics(every=41)(weights), FieldStatistics()(weights)
    assert (some[["maximum", "difference"]] <= every[["maximum", "difference"]]).all(axis=None)
    for name in ("entries", "exceeding", "inner_entries", "mean_r"):
        np.testing.assert_allclose(some[name], every[name], rtol=0.1)  # 98 hits for the 4000 that exceed


@pytest.mark.parametrize("exact", [True, False])
def test_exact_permutations_are_evaluated_once(weights, exact, monkeypatch):
    six = torch.stack([permute_channels(weights[0], order) for order in PERMUTATIONS])
    if not exact:
        six[3, 0] += 1e-3
    evaluated, call = [], FieldStatistics.__call__
    monkeypatch.setattr(FieldStatistics, "__call__", lambda self, w, p: evaluated.append(len(w)) or call(self, w))
    store = SimpleNamespace(weights=six, names=list(PERMUTATIONS))
    table = neumerl_statistics(store)
    assert evaluated == [1 if exact else 6]
    expected = call(FieldStatistics(), six)
    np.testing.assert_allclose(
        table.drop(columns="name").to_numpy(float), expected.to_numpy(float), rtol=1e-4, atol=1e-5
    )
