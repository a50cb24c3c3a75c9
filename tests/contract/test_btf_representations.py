"""What every representation of BTFs promises, over the whole registry."""

import math

import pytest
import torch

from neumat.btf.directions import random_pairs, spherical, ubo2003_directions
from neumat.btf.planes import prefilter
from neumat.btf.representations.registry import REPRESENTATIONS, load_representation, make
from neumat.btf.store import BtfStore
from neumat.errors import NeumatError
from neumat.seeds import torch_generator

SIDE = 8
NAMES = sorted(REPRESENTATIONS)
TABLES = ("pca", "sh")  # which take pictures of a grid of views and lights


def make_quick(name, **config):
    """Return a representation with small planes and little training."""
    return make(name, {} if name in TABLES else {"samples": 20_000, "side": 8} | config)


def lambertian(albedo, light):
    """Return the values (s, SIDE, SIDE, 3) of a flat Lambertian surface: albedo (SIDE, SIDE, 3), light (s, p, 3)."""
    cosine = light[:, :, 2].repeat(1, SIDE * SIDE // light.shape[1]).view(-1, SIDE, SIDE, 1)
    return albedo / math.pi * cosine


def store_of(function, name="ours", sweeps=64):
    """Return a store of `function` of the lights (s, p, 3), of the kind that the representation `name` takes."""
    if name in TABLES:
        grid = ubo2003_directions()[::4]
        view, light = grid.repeat_interleave(len(grid), 0)[:, None], grid.repeat(len(grid), 1)[:, None]
    else:
        light, view = (each.view(sweeps, 64, 3) for each in random_pairs(sweeps * 64, torch_generator(0, "toy")))
    kind = "pictures" if name in TABLES else "queries"
    return BtfStore.from_arrays(function(light), light, view, kind=kind)


@pytest.fixture(scope="module")
def albedo():
    return torch.rand(SIDE, SIDE, 3, generator=torch_generator(0, "albedo")) * 0.6 + 0.2


@pytest.fixture(scope="module", params=NAMES)
def fitted(request, albedo):
    store = store_of(lambda light: lambertian(albedo, light), request.param)
    return make_quick(request.param).fit(store, seed=3)


def test_evaluates_one_pair_for_all_and_a_pair_each(fitted):
    features = fitted.positional().flatten(0, 1)
    light, view = spherical(torch.tensor([[0.3], [0.5]]), torch.tensor([[1.0], [2.0]]))
    shared = fitted.eval(features, light, view)
    assert shared.shape == (SIDE * SIDE, 3)
    each = fitted.eval(features, light.expand(len(features), 3), view.expand(len(features), 3))
    assert torch.allclose(shared, each, rtol=1e-4, atol=1e-6)
    assert torch.equal(fitted.picture(light[0], view[0]), shared.view(SIDE, SIDE, 3))


def test_order_of_queries_changes_nothing(fitted):
    features = fitted.positional().flatten(0, 1)
    light, view = random_pairs(len(features), torch_generator(1, "queries"))
    order = torch.randperm(len(features), generator=torch_generator(1, "order"))
    found = fitted.eval(features, light, view)
    assert torch.allclose(fitted.eval(features[order], light[order], view[order]), found[order], rtol=1e-4, atol=1e-6)
    assert torch.allclose(fitted.eval(features[:5], light[:5], view[:5]), found[:5], rtol=1e-4, atol=1e-6)


def test_is_finite_and_not_negative_everywhere(fitted):
    theta, phi = torch.meshgrid(torch.linspace(0, math.pi, 19), torch.linspace(0, 6.3, 9), indexing="ij")
    directions = spherical(theta, phi).flatten(0, 1)
    light, view = directions.repeat(len(directions), 1), directions.repeat_interleave(len(directions), 0)
    features = fitted.positional().flatten(0, 1)[torch.arange(len(light)) % (SIDE * SIDE)]
    found = fitted.eval(features * 3, light, view)
    assert found.isfinite().all() and (found >= 0).all()
    assert (found[(light[:, 2] <= 0) | (view[:, 2] <= 0)] == 0).all()


@pytest.mark.parametrize("bad", [[math.nan] * 3, [math.nan, 0.0, 1.0], [0.0, 0.0, math.inf]])
def test_a_direction_that_is_none_gives_0_and_leaves_the_others_alone(fitted, bad):
    features = fitted.positional().flatten(0, 1)[:20]
    light, view = random_pairs(20, torch_generator(3, "broken"))
    expected = fitted.eval(features, light, view)
    for directions in (light, view):
        kept = directions[7].clone()
        directions[7] = torch.tensor(bad)
        expected[7] = 0
        assert torch.equal(fitted.eval(features, light, view), expected)
        directions[7] = kept


def test_saves_and_loads_exactly(fitted, tmp_path):
    path = tmp_path / "saved.safetensors"
    fitted.save(path)
    loaded = load_representation(path)
    light, view = random_pairs(1, torch_generator(2, "pair"))
    assert loaded == fitted
    assert torch.equal(loaded.picture(light[0], view[0]), fitted.picture(light[0], view[0]))
    assert fitted.bytes == loaded.bytes < path.stat().st_size


def test_levels_of_detail_halve_the_plane_down_to_one_texel_and_are_stored(fitted, tmp_path):
    levels = fitted.levels()
    assert torch.equal(levels[0], fitted.positional())
    assert [level.shape[:2] for level in levels] == [(8, 8), (4, 4), (2, 2), (1, 1)]
    fitted.save(tmp_path / "saved.safetensors")
    loaded = load_representation(tmp_path / "saved.safetensors").levels()
    assert all(torch.equal(*pair) for pair in zip(levels, loaded, strict=True))


def of_level(fitted, plane, light, view):
    """Return pictures (n, h, w, 3) of a model's level of detail (h, w, c) at pairs of directions (n, 3)."""
    pictures = [fitted.eval(plane.flatten(0, 1), *pair) for pair in zip(light[:, None], view[:, None], strict=True)]
    return torch.stack(pictures).view(len(light), *plane.shape[:2], 3)


@pytest.mark.parametrize("name", TABLES)
def test_levels_of_what_is_linear_decode_to_means_of_values(name, albedo):
    fitted = make(name, {"curve": 0.0}).fit(store_of(lambda light: lambertian(albedo, light), name), seed=0)
    light, view = random_pairs(20, torch_generator(4, "pairs"), math.radians(70))
    finest, level = (of_level(fitted, plane, light, view) for plane in fitted.levels()[:2])
    assert torch.allclose(level, finest.view(20, 4, 2, 4, 2, 3).mean((2, 4)), rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("name", ["ours", "triple-plane", "biplane", "neumip"])
def test_levels_of_networks_decode_nearer_to_means_of_values_than_means_of_features_do(name):
    """Of texels of two very different brightnesses, where means of features go wrong."""
    bright = torch.rand(SIDE, SIDE, 1, generator=torch_generator(0, "bright")) > 0.7
    albedo = torch.where(bright, 0.9, 0.02).expand(SIDE, SIDE, 3)
    fitted = make_quick(name, samples=100_000).fit(store_of(lambda light: lambertian(albedo, light)), seed=1)
    pairs = random_pairs(50, torch_generator(4, "pairs"), math.radians(70))

    def off(plane):
        means = of_level(fitted, plane, *pairs).mean((1, 2))
        return (means / of_level(fitted, fitted.positional(), *pairs).mean((1, 2)) - 1).abs().mean()

    for k in (1, -1):
        trained, means = (off(levels[k]) for levels in (fitted.levels(), prefilter(fitted.positional())))
        assert trained < 0.25 * means


@pytest.mark.parametrize("name", NAMES)
def test_same_seed_same_result(name, albedo):
    store = store_of(lambda light: lambertian(albedo, light), name)
    first, second = (make_quick(name).fit(store, seed=5) for _ in range(2))
    assert all(torch.equal(first.state[key], second.state[key]) for key in first.state)


@pytest.mark.parametrize("name", NAMES)
def test_fits_a_flat_lambertian_surface(name, albedo):
    """One colour, so that the mean BRDF can too."""
    grey = albedo[:1, :1].expand_as(albedo)
    store = store_of(lambda light: lambertian(grey, light), name)
    fitted = make_quick(name, samples=600_000 if name == "mean" else 100_000).fit(store, seed=1)
    light, view = random_pairs(32, torch_generator(3, "held out"), math.radians(70))
    found = torch.stack([fitted.picture(*pair) for pair in zip(light, view, strict=True)])
    expected = lambertian(grey, light[:, None])
    assert (found - expected).abs().mean() < 0.15 * expected.mean()


@pytest.mark.parametrize("name", NAMES)
def test_refuses_values_that_are_not_finite(name, albedo):
    def function(light):
        values = lambertian(albedo, light)
        values[7, 2, 3, 1] = math.nan
        return values

    with pytest.raises(NeumatError, match="finite values"):
        make_quick(name).fit(store_of(function, name), seed=0)


@pytest.mark.parametrize("name", sorted(set(NAMES) - set(TABLES)))
def test_takes_pictures_as_well(name, albedo):
    store = store_of(lambda light: lambertian(albedo, light), "pca")
    assert make_quick(name).fit(store, seed=0).picture(*store.light[0], *store.view[0].flatten(1)).shape == albedo.shape


@pytest.mark.parametrize("name", TABLES)
def test_refuses_a_store_without_a_grid(name, albedo):
    queries = store_of(lambda light: lambertian(albedo, light))
    with pytest.raises(NeumatError, match="pictures"):
        make(name).fit(queries, seed=0)
    grid = store_of(lambda light: lambertian(albedo, light), name)
    rest = BtfStore.from_arrays(grid.values(torch.arange(1, 441)), grid.light[1:], grid.view[1:], kind="pictures")
    with pytest.raises(NeumatError, match="every view under every light"):
        make(name).fit(rest, seed=0)


def test_refuses_unknown_names_and_files(tmp_path):
    with pytest.raises(NeumatError, match="one of"):
        make("quadruple-plane")
    with pytest.raises(NeumatError, match="one of"):
        make("ours", {"colour": 1})
    (tmp_path / "other.safetensors").write_bytes(b"12345678")
    with pytest.raises(NeumatError, match="saved representation"):
        load_representation(tmp_path / "other.safetensors")


@pytest.mark.parametrize(("name", "count"), [("ours", 2), ("triple-plane", 2), ("biplane", 1), ("neumip", 0)])
def test_planes_of_directions_can_be_looked_at(name, count, albedo):
    model = make_quick(name, samples=1000).fit(store_of(lambda light: lambertian(albedo, light), name), 0)
    assert [plane.shape for plane in model.directional()] == [(8, 8, model.features)] * count
