"""Surfaces: pure functions of position and seed, endless or exactly periodic, with the relief that they promise."""

import math
from pathlib import Path

import pytest
import torch
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.btf.surfaces.surface import PROCESSES, Surface
from neumat.config import load_surface
from neumat.errors import NeumatError

ROOT = Path(__file__).parents[3]
SCHEMA = ROOT / "workflow/schemas/surface.schema.json"
FILES = sorted((ROOT / "config/btf").glob("*.yaml"))
CONFIGS = {path.stem: load_surface(path, SCHEMA) for path in FILES}
TILEABLE = {name: Surface({**config, "tileable": True}) for name, config in CONFIGS.items()}
ENDLESS = {name: Surface(config) for name, config in CONFIGS.items()}
EXACT = 1 << 20  # u = k / EXACT: sums with integers below 1e9 are exact
MOVED = 4 / 256 / math.tan(math.radians(60))  # height that 60 degrees move by 4 of 256 texels

every_surface = pytest.mark.parametrize("name", CONFIGS)


def same(first, second):
    return all(torch.equal(a, b) for a, b in zip(first, second, strict=True))


def grid(n, exemplars=1):
    at = (torch.arange(n, dtype=torch.float64) + 0.5) / n * exemplars
    return torch.cartesian_prod(at, at)


@pytest.fixture
def u():
    return torch.rand(2000, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))


def test_there_is_a_surface_of_each_process():
    assert sorted(config["process"] for config in CONFIGS.values()) == sorted(PROCESSES)


@every_surface
@settings(deadline=None, max_examples=10)
@given(
    st.lists(st.tuples(*[st.integers(-EXACT, 2 * EXACT)] * 2), min_size=1, max_size=20),
    st.tuples(*[st.integers(-(10**6), 10**6)] * 2),
)
def test_a_tileable_surface_repeats_to_the_last_bit(name, places, shift):
    u = torch.tensor(places).double() / EXACT
    assert same(TILEABLE[name].at(u), TILEABLE[name].at(u + torch.tensor(shift)))


@every_surface
def test_a_period_of_three_repeats_after_three_exemplars_and_not_after_one(name, u):
    config = CONFIGS[name]
    u = (u * EXACT).floor() / EXACT

    def heights(shift):
        points = (u + torch.tensor(shift)).T.contiguous()
        return PROCESSES[config["process"]](points, 1, 3, **config["parameters"])

    assert same(heights([0, 0]), heights([3, -6]))
    if name != "metal":  # which repeats with each pair of lozenges
        assert not torch.equal(heights([0, 0])[0], heights([1, 0])[0])


@every_surface
def test_a_surface_is_continuous_across_the_border_of_a_tile_and_everywhere(name):
    along = torch.arange(4000, dtype=torch.float64)[:, None] / 4000
    inside = torch.rand(4000, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
    for step in (torch.tensor([1e-7, 0]), torch.tensor([0, 1e-7])):
        for u in (torch.where(step > 0, 1.0, along), inside):
            jump = TILEABLE[name].height(u + step) - TILEABLE[name].height(u - step)
            assert jump.abs().max() < 1e-5


@pytest.mark.parametrize("name", sorted(CONFIGS.keys() - {"wood"}))  # whose widest waves are as long as the exemplar
def test_inside_its_exemplar_a_tileable_surface_is_the_endless_one(name):
    u = 0.25 + 0.5 * grid(40)
    endless = TILEABLE[name].infinite()
    difference = TILEABLE[name].height(u) - endless.height(u)
    assert difference.max() - difference.min() < 1e-12  # but for the mean of either
    assert abs(difference.mean()) < 0.001
    assert torch.equal(TILEABLE[name].material(u), endless.material(u))


@every_surface
def test_an_endless_surface_never_repeats(name, u):
    """Not after an exemplar, and not where a lattice of 32-bit floats would; the regular one is turned."""
    height = ENDLESS[name].height(u)
    for shift in ([1, 0], [0, 1], [15, 15], [-3, 7], [1 << 16, 0]):
        other = ENDLESS[name].height(u + torch.tensor(shift))
        assert (other - height).std() > 0.3 * height.std()


@every_surface
def test_any_order_and_size_of_the_batch(name, u):
    height, material = ENDLESS[name].at(u)
    order = torch.randperm(len(u), generator=torch.Generator().manual_seed(1))
    assert same(ENDLESS[name].at(u[order]), (height[order], material[order]))
    assert same(ENDLESS[name].at(u[7:8]), (height[7:8], material[7:8]))
    many = torch.cat([u, u + 40.5, u[:8] * 1e5])  # few cells a point: drawn, not looked up
    assert same([part[: len(u)] for part in ENDLESS[name].at(many)], (height, material))
    assert len(ENDLESS[name].height(u[:0])) == 0


@every_surface
def test_far_from_the_origin_a_surface_is_like_near_it(name, u):
    for far in (-1e5, 1e5, 1e9):
        height, material = ENDLESS[name].at(far + 4 * u)
        near, _ = ENDLESS[name].at(4 * u)
        assert abs(height.std() / near.std() - 1) < 0.15
        assert set(material.tolist()) == set(range(len(ENDLESS[name].materials)))


@every_surface
def test_seeds_give_other_surfaces(name, u):
    if name != "metal":  # which has nothing random
        other = Surface({**CONFIGS[name], "seed": 2}).height(u)
        assert abs(torch.corrcoef(torch.stack([other, ENDLESS[name].height(u)]))[0, 1]) < 0.98


@every_surface
def test_heights_have_the_mean_and_the_relief_that_the_config_says(name):
    for surface, exemplars in ((TILEABLE[name], 1), (ENDLESS[name], 4)):
        height = surface.height(grid(160, exemplars))
        assert abs(height.mean()) < 0.001
        low, high = height.quantile(torch.tensor([0.001, 0.999], dtype=torch.float64))
        assert abs((high - low) / CONFIGS[name]["relief"] - 1) < 0.1
    assert torch.equal(surface.scaled(2).height(grid(5)), 2 * surface.height(grid(5)))


def test_views_move_texels_of_four_surfaces_by_four_and_of_wood_by_less_than_one():
    """Of 256 a side, between 0 and 60 degrees, at the ninth decile of the distance from the mean plane."""
    typical = {name: surface.height(grid(128)).abs().quantile(0.9) for name, surface in ENDLESS.items()}
    assert sum(height >= MOVED for height in typical.values()) >= 4
    assert typical["wood"] < MOVED / 4


@every_surface
def test_walls_are_not_steeper_than_a_mesh_can_follow(name):
    height = ENDLESS[name].height(grid(320)).reshape(320, 320)
    slope = (height.diff(dim=0).abs() * 320).flatten()
    assert slope.quantile(0.99) < 4 and slope.max() < 10


@every_surface
def test_each_material_covers_a_share(name):
    for surface in (TILEABLE[name], ENDLESS[name]):
        shares = torch.bincount(surface.material(grid(128))) / 128**2
        assert len(shares) == len(surface.materials) and shares.min() > 0.05


def written(tmp_path, **keys):
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(keys))
    return path


@pytest.mark.parametrize("process", PROCESSES)
def test_a_file_with_nothing_but_its_process_is_a_surface(process, tmp_path, u):
    surface = Surface(load_surface(written(tmp_path, process=process), SCHEMA))
    assert surface.height(u).isfinite().all()


@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("end", ["minimum", "maximum"])
def test_parameters_at_either_end_of_their_range_give_finite_heights(process, end, tmp_path, u):
    schema = load_schema()["$defs"][process]["properties"]["parameters"]["properties"]
    parameters = {key: child[end] for key, child in schema.items()}
    config = load_surface(written(tmp_path, process=process, parameters=parameters), SCHEMA)
    assert Surface(config).height(u).isfinite().all()


def load_schema():
    return yaml.safe_load(SCHEMA.read_text())


def test_the_files_leave_no_key_to_the_defaults():
    for path, config in zip(FILES, CONFIGS.values(), strict=True):
        assert yaml.safe_load(path.read_text()) == config


def test_a_material_may_be_a_file(tmp_path):
    (tmp_path / "mine.binary").touch()
    materials = [str(tmp_path / "mine.binary"), "brass"]
    assert load_surface(written(tmp_path, process="metal", materials=materials), SCHEMA)["materials"] == materials


def test_a_material_may_be_one_that_the_run_makes(tmp_path):
    path = written(tmp_path, process="metal", materials=["sample-7", "brass"])
    assert load_surface(path, SCHEMA, lambda: {"sample-7"})["materials"] == ["sample-7", "brass"]
    with pytest.raises(NeumatError, match="'sample-7'"):
        load_surface(path, SCHEMA, lambda: {"sample-6"})


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "the key process"),
        ({"process": "lether"}, '"leather" or "weave"'),
        ({"process": ["leather"]}, '"leather" or "weave"'),
        ({"process": "leather", "colour": 1}, "key colour: expected one of process"),
        ({"process": "leather", "parameters": {"repeats": 4}}, "key parameters.repeats: expected one of cells"),
        ({"process": "leather", "parameters": {"cells": 0}}, "parameters.cells: expected integer >= 1 and <= 64"),
        ({"process": "leather", "parameters": {"cells": 2.5}}, "parameters.cells: expected integer"),
        ({"process": "leather", "parameters": [1]}, "key parameters: expected a section"),
        ({"process": "wood", "relief": 2.0}, "key relief: expected number >= 0 and <= 0.2; found 2.0"),
        ({"process": "wood", "relief": math.nan}, "key relief: expected number"),
        ({"process": "wood", "size_mm": 0}, "key size_mm: expected number > 0"),
        ({"process": "wood", "seed": -1}, "key seed: expected integer >= 0"),
        ({"process": "wood", "tileable": "yes"}, "key tileable: expected boolean"),
        ({"process": "metal", "materials": ["brass"]}, "key materials: expected array of string, 2 of them"),
        ({"process": "metal", "materials": ["brass", "gold"]}, "key materials: expected names of embedded, fitted or"),
        ({"process": "metal", "materials": ["brass", 3]}, "key materials"),
    ],
)
def test_a_mistake_gets_one_line_that_names_the_file_and_the_key(keys, words, tmp_path):
    path = written(tmp_path, **keys)
    with pytest.raises(NeumatError) as error:
        load_surface(path, SCHEMA)
    assert str(path) in str(error.value) and words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["", "[1, 2]", "a: [", "process: leather\n: x"])
def test_what_is_no_surface_is_refused(text, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(NeumatError, match=r"mine\.yaml"):
        load_surface(path, SCHEMA)
    with pytest.raises(NeumatError, match="a surface's YAML file"):
        load_surface(tmp_path / "none.yaml", SCHEMA)
