from types import SimpleNamespace

import pytest
import torch

from neumat.errors import NeumatError
from neumat.generative.whitening import Coordinates
from neumat.studies.coverage import LEVELS, Sides, denoising_error


def test_a_denoiser_that_knows_its_training_materials_by_heart_shows():
    generator = torch.Generator().manual_seed(0)
    training, held_out = (torch.randn(n, 675, generator=generator) for n in (30, 10))
    coordinates = Coordinates.fit(training, 400, "variance", 1.0, generator)
    known = coordinates.encode(training)
    model = SimpleNamespace(
        restored=lambda: (coordinates, lambda x, sigma: known[torch.cdist(x, known).argmin(1)]),
        sorted=lambda weights: (weights, None),
    )
    sides = SimpleNamespace(protocol="fold0", seed=0, weights={"training": training, "held_out": held_out})
    error = denoising_error(sides, model).set_index(["side", "sigma"])["error"]
    assert error["training", LEVELS[0]] == pytest.approx(0, abs=1e-6)
    assert error["held_out", LEVELS[0]] > 0.5


def test_coverage_is_of_folds_only():
    with pytest.raises(NeumatError, match="a fold, which holds out sources"):
        Sides("parity", ("a", "b", "c"), 64, {}, 0)
