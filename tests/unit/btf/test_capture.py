"""The virtual gonioreflectometer: closed forms of light on known shapes, and numbers that don't depend on shards."""

import math
from pathlib import Path

import h5py
import pytest
import torch

from neumat.brdf.coordinates import ENTRIES, rusinkiewicz
from neumat.brdf.embedded import Embedded, embedded_names
from neumat.brdf.table import Table
from neumat.btf import capture
from neumat.btf.directions import concentric_direction, spherical
from neumat.btf.gonioreflectometer import Facets, Gonioreflectometer
from neumat.btf.relief import relief
from neumat.btf.store import read_btf
from neumat.btf.surfaces.surface import Surface
from neumat.config import load_surface
from neumat.errors import NeumatError

ROOT = Path(__file__).parents[3]
UP = torch.tensor([[[0.0, 0.0, 1.0]]])


@pytest.fixture(scope="module")
def facets():
    """Two Lambertian materials: white, and one of albedo 0.2."""
    return Facets([Table(torch.full((ENTRIES, 3), albedo / math.pi)) for albedo in (1.0, 0.2)])


@pytest.fixture(scope="module")
def measure(facets):
    def values(surface, texels, light, view, samples=1, bounces=3, margin=0.5, quads=2):
        """Return values (texels, texels) in green, for pairs (1, p, 3)."""
        all_ = range(texels)
        part = relief(surface, texels, all_, all_, margin, quads)
        instrument = Gonioreflectometer(part, facets, all_, all_, texels, texels, bounces)
        found, lost = instrument.values(light, view, [7], samples)
        assert lost == 0
        return found[0, ..., 1]

    return values


def at(theta, phi=0.0):
    return spherical(torch.tensor(math.radians(theta)), torch.tensor(phi)).view(1, 1, 3)


def concat(blocks):
    return torch.cat([values for *_, values in blocks])


def test_flat_lambertian_surface_is_albedo_over_pi_times_cosine(shape, measure):
    for theta in (0, 40, 84):
        found = measure(shape(), 8, at(theta), at(30, 2.0), samples=3)
        assert torch.allclose(found, torch.tensor(math.cos(math.radians(theta)) / math.pi), rtol=1e-5)


def test_flat_surface_gives_its_material_back(shape):
    for name in ("gold-paint", "red-phenolic"):
        directions = capture.query_directions(range(2), 128, 0)
        blocks = capture.capture_queries(shape(materials=[name]), 16, range(2), *directions, 2, 0)
        found = concat(blocks).view(2, 2, 128, 3)
        light, view = directions
        angles = rusinkiewicz(light.view(-1, 3), view.view(-1, 3))
        expected = Embedded(embedded_names().index(name)).eval(*angles).view(2, 1, 128, 3) * light[:, None, :, 2:]
        # Read from a table on MERL's grid: 0.05 % in the mean, and 5 % at the edge of a highlight.
        error = (found - expected).abs() / (expected + 1e-3)
        assert error.mean() < 1e-3 and error.max() < 0.1


def test_a_facet_may_be_a_field_of_a_store(shape, lambert, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["samples"] = lambert(0.2, 0.5).numpy()
    surface = shape(materials=["sample-1"])
    options = {"stores": {"sample-1": tmp_path / "a.h5"}}
    found = concat(capture.capture_pictures(surface, 16, at(30)[0], at(50)[0], 1, 0, **options))
    assert torch.allclose(found, torch.tensor(0.5 * math.cos(math.radians(30)) / math.pi), rtol=1e-3)


def test_light_below_the_horizon_gives_black(shape, measure):
    assert measure(shape(), 4, at(95), UP).abs().max() == 0


def test_groove_reflects_more_with_each_bounce_and_never_more_than_it_receives(shape, measure):
    groove = shape(lambda x, y: (4 * x % 1 - 0.5).abs() * 0.5)  # walls at 63 degrees
    texels = 64
    generator = torch.Generator().manual_seed(0)
    z, phi = torch.rand(1, texels**2, generator=generator), torch.rand(1, texels**2, generator=generator)
    light = spherical(torch.acos(z), 2 * math.pi * phi)
    view = at(25, 0.4).expand_as(light)
    albedo = [
        2 * math.pi * measure(groove, texels, light, view, 16, bounces, margin=1.0).mean() for bounces in (1, 2, 12)
    ]
    assert 0.3 < albedo[0] < albedo[1] - 0.1 < albedo[1] < albedo[2] - 0.05
    assert 0.9 < albedo[2] < 1.01


def test_wall_throws_a_shadow_of_its_height_times_the_tangent(shape, measure):
    wall = shape(lambda x, y: 0.1 * ((x > 0.5) & (x < 0.6)))
    found = measure(wall, 100, at(60), UP, bounces=1).mean(0)
    lit = math.cos(math.radians(60)) / math.pi
    end = 0.5 - 0.1 * math.tan(math.radians(60))
    assert torch.allclose(found[: round(100 * end) - 1], torch.tensor(lit), rtol=1e-4)
    assert found[round(100 * end) + 1 : 48].abs().max() == 0
    assert torch.allclose(found[52:58], torch.tensor(lit), rtol=1e-4)


def test_raised_plane_is_shifted_by_its_height_times_the_tangent(shape, measure):
    raised = shape(lambda x, y: 0 * x + 0.1, lambda x, y: x > 0.6)
    bright, dark = 1 / math.pi, 0.2 / math.pi
    for theta, phi, shift in ((0, 0.0, 0.0), (45, 0.0, 0.1), (60, math.pi, -0.1 * math.sqrt(3))):
        found = measure(raised, 100, UP, at(theta, phi)).mean(0)
        border = round(100 * (0.6 - shift))
        assert torch.allclose(found[: border - 1], torch.tensor(bright), rtol=1e-4)
        assert torch.allclose(found[border + 1 :], torch.tensor(dark), rtol=1e-4)


def test_samples_fill_a_texel_evenly(shape, measure):
    halves = shape(material=lambda x, y: x > 0.52)  # between vertices at 16 / 32 and 17 / 32: a quarter of texel 8
    found = measure(halves, 16, UP, UP, samples=16)[:, 8] * math.pi
    error = (found - (0.25 * 1.0 + 0.75 * 0.2)).square().mean().sqrt()
    assert error < 0.6 * 0.8 * math.sqrt(0.25 * 0.75 / 16)  # of independent positions


def test_picture_of_a_tileable_surface_is_periodic(waves, measure):
    light, view = at(50, 1.0), at(60, 2.0)
    moved = type(waves)(lambda x, y: waves.height(x + 0.5, y), lambda x, y: waves.material(x + 0.5, y))
    first, second = (measure(s, 32, light, view, samples=64, bounces=1) for s in (waves, moved))
    assert (first.roll(16, 1) - second).abs().mean() < 0.02 * first.mean()
    assert (first - second).abs().mean() > 0.1 * first.mean()


def test_no_path_is_lost_at_the_border_up_to_the_largest_angle(shape, caplog):
    ditch = shape(lambda x, y: 0.02 - 0.04 * (x > 0.2))  # seen from the left, the border is deep below
    view = at(84.9, math.pi).view(1, 3)
    with caplog.at_level("INFO"):
        found = concat(capture.capture_pictures(ditch, 16, UP[0], view, 1, 0))
    assert (found > 0).all()
    assert "of which 0 left" in caplog.text


def test_numbers_of_a_sweep_do_not_depend_on_what_is_captured_with_it(waves, monkeypatch):
    def queries(sweeps, seed=1):
        directions = capture.query_directions(sweeps, 32, seed)
        return concat(capture.capture_queries(waves, 16, sweeps, *directions, 3, seed))

    together = queries(range(5))
    assert torch.equal(together, torch.cat([queries(range(2)), queries(range(2, 5))]))
    assert not torch.equal(together[0], together[1])
    monkeypatch.setattr(capture, "PATHS", 1)
    assert torch.equal(together, queries(range(5)))
    assert not torch.equal(together, queries(range(5), seed=2))


def test_numbers_of_a_picture_do_not_depend_on_the_others_nor_on_its_parts(waves, monkeypatch, tmp_path):
    square = torch.rand(3, 2, 2, generator=torch.Generator().manual_seed(0)) * 0.6 + 0.2
    light, view = concentric_direction(square).unbind(1)

    def pictures(name, *chosen):
        path = tmp_path / f"{name}.h5"
        capture.write_pictures(path, waves, 8, light[list(chosen)], view[list(chosen)], 4, 0, extent=2)
        return read_btf(path)

    store = pictures("a", 0, 1, 2)
    assert (store.kind, store.height, store.extent, store.pairs, store.surface) == ("pictures", 16, 2, 1, waves.config)
    together = store.values([2, 0])
    assert torch.equal(together, pictures("b", 2, 0).values([0, 1]))
    monkeypatch.setattr(capture, "PART", 6)
    parts = pictures("c", 0, 1, 2).values([2, 0])
    # Coordinates are relative to the part: where rounding makes a ray pass an edge, its texel differs.
    assert ((parts - together).abs() < 2e-3 * together.float().mean()).float().mean() > 0.97


def test_shards_gather_to_the_store_of_one_job(waves, tmp_path):
    def write(name, sweeps):
        capture.write_queries(tmp_path / name, waves, 8, sweeps, 16, 2, 3)
        return tmp_path / name

    shards = [write(f"{k}.h5", capture.share(5, k, 6)) for k in range(6)]  # the first has nothing to do
    capture.gather(shards, tmp_path / "gathered.h5")
    gathered, whole = read_btf(tmp_path / "gathered.h5"), read_btf(write("whole.h5", range(5)))
    assert torch.equal(gathered.values(range(5)), whole.values(range(5)))
    assert torch.equal(gathered.light, whole.light) and torch.equal(gathered.view, whole.view)
    assert (gathered.kind, gathered.samples, gathered.size_mm, gathered.tileable) == ("queries", 2, 10.0, True)
    other = type(waves)(waves.height, config={"name": "other"})
    capture.write_queries(tmp_path / "other.h5", other, 8, range(1), 16, 2, 3)
    with pytest.raises(NeumatError, match=r"other\.h5"):
        capture.gather([shards[0], tmp_path / "other.h5"], tmp_path / "bad.h5")
    assert not (tmp_path / "bad.h5").exists()


def test_surface_of_a_config_is_captured_with_all_that_tells_what_it_is(tmp_path):
    config = load_surface(ROOT / "config/btf/weave.yaml", ROOT / "workflow/schemas/surface.schema.json")
    surface = Surface({**config, "tileable": True})
    capture.write_queries(tmp_path / "a.h5", surface, 12, range(2), 16, 4, 0)
    light = view = torch.tensor([[0.0, 0.6, 0.8]])
    capture.write_pictures(tmp_path / "b.h5", surface.infinite(), 12, light, view, 1, 0, extent=1.5)
    queries, pictures = read_btf(tmp_path / "a.h5"), read_btf(tmp_path / "b.h5")
    for store, size in ((queries, 12), (pictures, 18)):
        values = store.values(range(store.sweeps)).float()
        assert values.shape == (store.sweeps, size, size, 3)
        assert 0 < values.mean() < 1 / math.pi and (values > 0).float().mean() > 0.5
        assert (store.surface, store.size_mm) == (surface.config, config["size_mm"])
    assert (queries.tileable, pictures.tileable, pictures.extent) == (True, False, 1.5)


@pytest.mark.parametrize(("count", "shards"), [(5, 3), (2, 4), (500, 7), (0, 1)])
def test_shares_are_all_of_it_once(count, shards):
    assert [k for shard in range(shards) for k in capture.share(count, shard, shards)] == list(range(count))
