import numpy as np
import pandas as pd
import pytest
import torch

from neumat.brdf.coordinates import grid_angles
from neumat.fields.field import evaluate
from neumat.fields.layout import SIZE
from neumat.generative.constrained import Found, write_found
from neumat.metrics.materials import MaterialSet
from neumat.studies.constrained import constrained_table

RULES = {
    "f_diffuse": 0.3,
    "exceptions": 80_000,
    "metallic_share": 0.25,
    "specular": [100, 600],
    "plastic_tolerance": 0.05,
    "mirror_width": 0.0349,
}


def constants(values):
    """Fields that are constant in every direction and grey."""
    weights = torch.zeros(len(values), SIZE)
    weights[:, -3:] = torch.log1p(torch.tensor(values))[:, None]
    return weights


class OfConstants:
    """A protocol over four base materials in six equal permutations; all but the last are for training."""

    seed = 0
    weights = constants(np.repeat([0.1, 0.12, 0.2, 0.5], 6).astype(np.float32))
    train = np.arange(18)
    entries = torch.arange(0, 1000, 10)

    def fields(self, weights, pictures, step):
        entries = self.entries[::step]
        return MaterialSet(entries, evaluate(weights, *grid_angles(entries)))

    def materials(self, indices, pictures, step):
        return self.fields(self.weights[indices], pictures, step)


@pytest.fixture
def statistics():
    exceeding = np.repeat([0, 0, 500_000, 900_000], 6)
    table = pd.DataFrame({"entries": 1_000_000, "exceeding": exceeding, "difference": 0.0, "half_width": 1.5})
    return table.assign(maximum=1.0, mean_r=1.0, mean_g=1.0, mean_b=1.0)


def test_table_by_hand(tmp_path, statistics):
    found = {
        "diffuse": Found(constants([0.1, 0.11]).numpy(), tried=40, accepted=4, invalid=1),
        "metallic": Found(np.empty((0, SIZE), np.float32), tried=40),
        "mirror": Found(constants([0.1]).numpy(), tried=10, accepted=1),
    }
    for category, result in found.items():
        write_found(tmp_path / f"{category}.h5", category, "rejection", result, 2, 8.0, 0)
    paths = [tmp_path / f"{category}.h5" for category in ("mirror", "metallic", "diffuse")]
    table = constrained_table(paths, OfConstants(), statistics, RULES, 2).set_index("category")
    assert list(table.index) == ["diffuse", "metallic", "mirror"]
    row = table.loc["diffuse"]
    assert (row["found"], row["tried"], row["acceptance"], row["seconds_per_accepted"]) == (2, 40, 0.1, 2)
    assert row["training_share"] == pytest.approx(12 / 18)
    # Samples at .1 and .11, members at .1 and .12: the lower median of 0 and |log(1.1) - log(1.11)|.
    assert row["nearest_member"] == pytest.approx(0, abs=1e-6)
    assert row["member_to_member"] == pytest.approx(np.log(1.12 / 1.1), rel=1e-4)
    assert 0 <= row["one_nna"] <= 100
    assert table.loc["metallic", "seconds_per_accepted"] == np.inf and np.isnan(table.loc["metallic", "one_nna"])
    assert np.isnan(table.loc["mirror", ["one_nna", "nearest_member"]].to_numpy(float)).all()
