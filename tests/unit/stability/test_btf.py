"""The cases of BTFs on a toy surface, and that a guard which is taken away shows in the table."""

import logging
from pathlib import Path

import pytest
import torch

from neumat.btf.representations.encoding import Encoding
from neumat.btf.synthesis import SYNTHESES
from neumat.btf.synthesis.base import Synthesis
from neumat.btf.synthesis.gaussian import GaussianPlane
from neumat.config import load_surface
from neumat.errors import NeumatError
from neumat.seeds import torch_generator
from neumat.stability.btf_bench import BtfBench
from neumat.stability.btf_inputs import input_cases
from neumat.stability.btf_synthesis import synthesis_cases
from neumat.stability.cases import case, refused, warned
from neumat.stability.stress import COLUMNS, stress_table, stressed

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def plane():
    """Smooth features (32, 32, 3) of few waves that don't end at the border."""
    y, x = torch.meshgrid(torch.arange(32) / 32, torch.arange(32) / 32, indexing="ij")
    generator = torch_generator(0, "waves")
    waves, phase = torch.rand(2, 3, 20, generator=generator) * 9 - 4.5, torch.rand(3, 20, generator=generator) * 6.3
    return torch.sin(6.3 * (waves[0] * x[..., None, None] + waves[1] * y[..., None, None]) + phase).sum(-1)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    surface = load_surface(ROOT / "config/btf/leather.yaml", ROOT / "workflow/schemas/surface.schema.json")
    return BtfBench(surface, 16, 4, 20_000, 64, 0, tmp_path_factory.mktemp("stability"))


def rows(cases, part):
    """Return the rows {name: (found, ok)} of the stresses whose name contains `part`."""
    found = [stressed(each, "/none") for each in cases if part in each.name]
    assert found
    return {name: (result, passed) for name, _, result, _, passed in found}


def test_a_row_says_what_happened():
    def refuse():
        raise NeumatError("here", "two", "one")

    def broken():
        raise ValueError("of no one's")

    def warn():
        logging.warning("careful")
        return "found", True

    cases = [
        case("right", "e", "g", lambda: ("found", True)),
        case("wrong", "e", "g", lambda: ("found", False)),
        refused("refused", "two", "g", refuse),
        refused("refused for another reason", "three", "g", refuse),
        refused("not refused", "two", "g", lambda: ("two", True)),
        case("refused without need", "e", "g", refuse),
        case("crash", "e", "g", broken),
        warned("warned", "e", "careful", "g", warn),
        warned("not warned", "e", "found", "g", lambda: ("found", True)),
        case("warned without need", "e", "g", warn),
    ]
    table = stress_table(cases, "folder")
    assert list(table.columns) == COLUMNS
    assert table["ok"].tolist() == [True, False, True, False, False, False, False, True, False, True]
    assert set(table["guard"]) == {"g"}
    assert table["found"].iloc[6] == "ValueError: of no one's"


def test_every_method_of_synthesis_has_its_rows(plane):
    names = [each.name for each in synthesis_cases(plane, 0, 64)]
    assert len(names) == len(set(names))
    for method in SYNTHESES:
        assert sum(name.endswith(f": {method}") for name in names) >= 7


@pytest.mark.parametrize(
    "part", ["colour", "texels:", "in a plane", "u about", "u is", "level of", "batch", "under a pixel"]
)
def test_no_method_breaks_on(plane, part):
    found = rows(synthesis_cases(plane, 0, 512), part)
    assert all(passed for _, passed in found.values()), found


def test_a_plane_that_is_not_checked_shows(plane, monkeypatch):
    monkeypatch.setattr(torch.Tensor, "isfinite", lambda self: torch.ones_like(self, dtype=torch.bool))
    assert not any(passed for _, passed in rows(synthesis_cases(plane, 0, 8), "nan in a plane: tiling").values())


def test_features_that_are_not_cut_show(plane, monkeypatch):
    def uncut(self, *arguments):
        self.low, self.high = self.low - torch.inf, self.high + torch.inf
        return kept(self, *arguments)

    kept = GaussianPlane.blend
    monkeypatch.setattr(GaussianPlane, "blend", uncut)
    assert not rows(synthesis_cases(plane, 0, 2048), "tiny")["tiny exemplar, 16 x 16: histogram"][1]


def test_positions_that_lose_precision_show(plane, monkeypatch):
    kept = Synthesis.at
    monkeypatch.setattr(Synthesis, "at", lambda self, u, level=0.0: kept(self, u.float().double(), level))
    assert not any(passed for _, passed in rows(synthesis_cases(plane, 0, 64), "u about").values())


def test_fits_answer_odd_directions_and_features(bench):
    cases = [*input_cases(bench)]
    found = rows(cases, "horizon") | rows(cases, "NaN in the light") | rows(cases, "of their ranges")
    assert len(found) == 5 and all(passed for _, passed in found.values()), found


def test_stores_with_nan_are_refused(bench):
    found = rows(input_cases(bench), " in a ") | rows(input_cases(bench), "in memory")
    assert all(passed for _, passed in found.values()), found


def test_a_ceiling_that_is_taken_away_shows(bench, monkeypatch):
    kept = Encoding.decode
    monkeypatch.setattr(Encoding, "decode", lambda self, x: kept(Encoding(self.exposure, self.curve), x * 20 + 20))
    found = rows(input_cases(bench), "ours, queries")
    assert not any(passed for _, passed in found.values()), found
