from pathlib import Path

import torch

from neumat.config import load
from neumat.fields.layout import SIZE
from neumat.studies.dense_fits import Alignment, budgets

SCHEMA = Path(__file__).parents[3] / "workflow/schemas/config.schema.json"


def test_every_budget_changes_one_thing():
    config = load({}, SCHEMA)["fit"]
    (method, configured), *others = budgets(config)
    assert method == "configured" and configured == config
    for _, changed in others:
        assert changed | {"dense": config["dense"]} == config
        assert sum(changed["dense"][key] != value for key, value in config["dense"].items()) == 1


def test_alignment_is_what_the_axes_leave():
    generator = torch.Generator().manual_seed(0)
    axes = torch.randn(8, SIZE, generator=generator)
    inside, fresh = (torch.randn(30, 8, generator=generator) @ axes for _ in range(2))
    alignment = Alignment(inside)
    assert alignment.error(inside) < 1e-4
    assert 0.5 < alignment.error(torch.randn(30, SIZE, generator=generator)) < 1.5
    assert alignment.error(fresh) < alignment.error(fresh + torch.randn(30, SIZE, generator=generator))
