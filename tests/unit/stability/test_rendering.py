"""The stresses on toy materials, and that a broken plugin or a guard that is taken away shows in the table."""

import numpy as np
import pytest
import torch

from neumat.brdf import sources
from neumat.brdf.coordinates import above_horizon, grid_angles
from neumat.export.merl import write_field
from neumat.fields.field import Field, evaluate
from neumat.stability import rendering as stability
from neumat.stability.render_bench import RenderBench, constant, deviation, highlight, reference, scaled
from neumat.stability.rendering import stability_table, stresses
from neumat.stability.stress import stressed

NAMES = ("matte", "satin", "mirror")
QUERIES = 4000
FIELDS = torch.stack([highlight(0.05, 0.1, 1.0), highlight(0.03, 1.0, 5.0), highlight(0.02, 3000.0, 1500.0)])


class Store:
    """The fields' own values in place of measured ones."""

    entries = above_horizon().nonzero()[::40, 0].numpy()

    def values(self, index, positions):
        return evaluate(FIELDS[index][None], *grid_angles(self.entries[positions]))[0].numpy()

    def materialise(self, index, path):
        write_field(path, FIELDS[index], {"name": NAMES[index]})


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return RenderBench(list(NAMES), FIELDS, Store(), range(3), tmp_path_factory.mktemp("bench"), 0, QUERIES)


@pytest.fixture
def row(bench):
    def of(name):
        """Return (found, guard, ok) of the stress of this name."""
        (stress,) = (stress for stress in stresses(bench) if stress.name == name)
        return stressed(stress, bench.folder)[2:]

    return of


@pytest.fixture
def plugins():
    """The module of the plugins, which can be imported once an LLVM library is chosen."""
    from neumat.render import mitsuba_bsdf

    return mitsuba_bsdf


def test_what_is_expected_of_every_stress_happens(bench, check_stresses):
    table = stability_table(bench)
    check_stresses(table)
    assert set(table["guard"]) == {"refused", "limited", "none needed"}


@pytest.mark.parametrize(
    ("name", "attribute", "value"),
    [
        ("NaN in the text of weights", "checked_field", Field),
        ("infinity in an update of mi.traverse", "checked_field", Field),
        ("weights of 3e38, whose sums overflow", "LARGEST_WEIGHT", np.inf),
    ],
)
def test_a_guard_of_the_plugin_that_is_gone_shows(row, plugins, monkeypatch, name, attribute, value):
    assert row(name)[1:] == ("refused", True)
    monkeypatch.setattr(plugins, attribute, value)
    found, guard, ok = row(name)
    assert guard == "none" and not ok and "loaded" in found


@pytest.mark.filterwarnings("ignore:overflow encountered in cast")
def test_a_limit_that_is_gone_shows(row, plugins, monkeypatch):
    assert row("field of e^89 / sr, infinite in float32")[1:] == ("limited", True)
    monkeypatch.setattr(plugins.drjit_brdf, "LARGEST_LOG", 1e9)
    found, guard, ok = row("field of e^89 / sr, infinite in float32")
    assert guard == "none" and not ok and "0 pixels" not in found
    monkeypatch.setattr(sources, "finite_halves", lambda values: True)
    assert not row("table of 1e5 / sr as a source, which are stored in float16")[2]


def test_a_value_that_is_off_shows(bench, row, plugins, monkeypatch):
    exact = plugins.drjit_brdf.field_value
    monkeypatch.setattr(plugins.drjit_brdf, "field_value", lambda *args: exact(*args) * 1.05)
    for name in ("view at 89.9 degrees: field", f"{bench.queries} random queries: field, Dr.Jit against torch",
                 "view and light the same", "mirror direction at 89.9 degrees"):  # fmt: skip
        assert row(name)[1:] == ("none", False), name
    monkeypatch.setattr(plugins.drjit_brdf, "field_value", lambda weights, wi, wo: exact(weights, wi, wo) + 1e-5 * wi.x)
    for name in ("view and light swapped: field, Dr.Jit", "field of 675 zeros", "nearly black: log(1 + f) times 1e-06"):
        assert row(name)[1:] == ("none", False), name


def test_a_density_that_is_off_shows(row, plugins, monkeypatch):
    exact = plugins.drjit_brdf.lobes_density
    monkeypatch.setattr(plugins.drjit_brdf, "lobes_density", lambda *args: 1.2 * exact(*args))
    for name in ("view at 60 degrees: field", "sampler all in the sharpest lobe"):
        assert row(name)[1:] == ("none", False), name


def test_light_from_below_shows(bench, row, monkeypatch):
    monkeypatch.setattr(
        RenderBench, "evaluate", lambda self, plugin, wi, wo: (torch.full((len(wi), 3), 0.1), torch.ones(len(wi)))
    )
    assert row("light below the horizon") == (f"{bench.draws} pairs, field and table: not all 0", "none", False)


def test_the_largest_deviation_from_the_tables_is_named(row, monkeypatch):
    name = "1000000 random queries: fields against their measured tables"
    exact = Store.values

    def planted(self, index, positions):
        values = exact(self, index, positions)
        values[7] += 1000.0 * (index == 1)
        return values

    monkeypatch.setattr(Store, "values", planted)
    found, _, ok = row(name)
    assert ok and "by 1e+03, satin at theta_h" in found
    monkeypatch.setattr(Store, "values", lambda *args: exact(*args) + 0.1)
    assert not row(name)[2]


def test_energy_that_conserve_leaves_shows(bench, row, monkeypatch):
    monkeypatch.setattr(bench, "weights", torch.stack([constant(albedo / np.pi) for albedo in (0.2, 1.5, 0.5)]))
    found, _, ok = row("view beyond 85 degrees, with conserve")
    assert ok and "at most 1.5 of the light without conserve (satin" in found
    monkeypatch.setattr(stability, "largest_albedo", lambda material: 1.0)
    assert not row("view beyond 85 degrees, with conserve")[2]


def test_a_refusal_by_traceback_is_none(row, plugins, monkeypatch):
    def crash(weights):
        raise ValueError("not\na number")

    monkeypatch.setattr(plugins, "checked_field", crash)
    assert row("NaN in an update of mi.traverse")[1:] == ("none", False)


def test_known_fields(bench):
    wi, wo = bench.pairs("known", 100)
    assert torch.allclose(
        reference(constant(1e5), wi, wo)[0], torch.full((100, 3), 1e5, dtype=torch.float64), rtol=1e-5
    )
    f = reference(FIELDS[2], *(torch.tensor([[0.0, 0.6, 0.8]]) * torch.tensor([1.0, sign, 1]) for sign in (1, -1)))[0]
    assert torch.allclose(f.log1p(), torch.full((1, 3), np.log(3001) + np.log(1.02), dtype=torch.float64), rtol=1e-4)
    dark = reference(scaled(FIELDS[0], 1e-3), wi, wo)[0]
    assert torch.allclose(dark.log1p(), 1e-3 * reference(FIELDS[0], wi, wo)[0].log1p())
    assert deviation(torch.tensor([[1.0, torch.nan, 3.0]]), torch.ones(1, 3)).item() == np.inf
