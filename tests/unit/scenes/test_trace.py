"""Traces and replays against Mitsuba's own pictures of the same compositions."""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
import torch

from neumat.render.mitsuba_scene import mitsuba
from neumat.scenes.compose import MAX_DEPTH, compose
from neumat.scenes.replay import importance, queried, replay
from neumat.scenes.textures import MASKS, texture
from neumat.scenes.trace import trace

pytestmark = pytest.mark.usefixtures("compiled")
WIDTH, HEIGHT, SAMPLES = 8, 6, 512


@dataclasses.dataclass
class Case:
    """A Trace of a layout, the materials {unit: material} it was traced with, and Mitsuba's picture."""

    trace: object
    materials: dict
    picture: np.ndarray


@pytest.fixture(scope="module")
def case(layout):
    def make(objects, models, seed=1):
        made = layout(objects)
        composition = compose(made, {unit: model.plugin(None) for unit, model in models.items()}, WIDTH, HEIGHT)
        picture = np.array(mitsuba().render(composition.scene, spp=8 * SAMPLES, seed=7))
        materials = {unit: model.material for unit, model in models.items()}
        return Case(trace(composition, made, SAMPLES, seed), materials, picture)

    return make


@pytest.fixture(scope="module")
def pair(case, grey, glossy):
    """A glossy ball on a matte floor."""
    objects = {"floor": ("plane", ["a"], {}), "ball": ("sphere", ["b"], {})}
    return case(objects, {("floor", 0): grey(0.5), ("ball", 0): glossy})


@pytest.fixture(scope="module")
def plain(case, grey):
    return case({"ball": ("sphere", ["a"], {})}, {("ball", 0): grey(0.8)})


@pytest.fixture(scope="module")
def blended(case, grey):
    objects = {"ball": ("sphere", ["a", "b"], {"masks": ["spots"]})}
    return case(objects, {("ball", 0): grey(0.8), ("ball", 1): grey(0.1)})


@pytest.fixture(scope="module")
def dented(case, glossy):
    return case({"ball": ("sphere", ["a"], {"normals": "hammered"})}, {("ball", 0): glossy})


@pytest.fixture(scope="module")
def sheet(case, grey, glossy):
    """All that a surface can have."""
    more = {"masks": ["spots"], "normals": "hammered", "bump": "weave", "depth": 0.02}
    return case({"sheet": ("drape", ["a", "b"], more)}, {("sheet", 0): glossy, ("sheet", 1): grey(0.1)})


def again(case, values=None):
    """Return the replay (n, 3) with the true materials, or other values."""
    return replay(case.trace, queried(case.trace, case.materials) if values is None else values)


@pytest.mark.parametrize("name", ["pair", "plain", "blended", "dented", "sheet"])
def test_a_replay_with_the_true_materials_is_mitsubas_picture(name, request):
    case = request.getfixturevalue(name)
    radiance = again(case)
    pixels = radiance.view(HEIGHT, WIDTH, SAMPLES, 3)
    assert torch.allclose(case.trace.picture(radiance), pixels.mean(2))
    error = (pixels.var(2) / SAMPLES).sum((0, 1)).sqrt().numpy() / (WIDTH * HEIGHT)
    expected = case.picture.mean((0, 1))
    assert (error < 0.01 * expected).all()
    assert (np.abs(radiance.mean(0).numpy() - expected) < 4 * error).all()
    # Nor are pixels swapped or shifted.
    assert np.corrcoef(pixels.mean(2).numpy().ravel(), case.picture.ravel())[0, 1] > 0.9


def test_factors_do_not_depend_on_the_materials_that_are_replayed(pair, case, grey, glossy):
    """A darker floor, replayed on the paths of a bright one, is a darker floor's own picture."""
    objects = {"floor": ("plane", ["a"], {}), "ball": ("sphere", ["b"], {})}
    dark = case(objects, {("floor", 0): grey(0.1), ("ball", 0): glossy})
    found = again(pair, queried(pair.trace, pair.materials | dark.materials))
    assert np.allclose(found.mean(0), dark.picture.mean((0, 1)), rtol=0.03)
    assert (dark.picture.mean((0, 1)) < 0.8 * pair.picture.mean((0, 1))).all()


def test_a_ball_alone_shines_in_proportion_to_its_material(plain):
    values = queried(plain.trace, plain.materials)
    lit, doubled = again(plain), again(plain, {key: 2 * value for key, value in values.items()})
    assert torch.allclose(doubled - plain.trace.seen, 2 * (lit - plain.trace.seen), rtol=1e-5, atol=1e-6)
    asked = [part[unit] for vertex in plain.trace.vertices[1:] for part in (vertex.lit, vertex.onward) for unit in part]
    assert sum(len(queries.path) for queries in asked) == 0


def test_black_materials_leave_the_lights_in_direct_view(pair):
    values = {key: torch.zeros_like(value) for key, value in queried(pair.trace, pair.materials).items()}
    assert torch.equal(again(pair, values), pair.trace.seen)
    assert (pair.trace.seen[pair.trace.first >= 0] == 0).all()
    assert (pair.trace.seen[pair.trace.first < 0] > 0).all()


def test_reflections_of_the_floor_make_light_of_the_second_vertex(pair):
    """The radiance is a polynomial of the scale of all materials, of the degree of the number of vertices."""
    values = queried(pair.trace, pair.materials)
    powers = torch.stack([again(pair, {key: s * value for key, value in values.items()}).mean() for s in range(6)])
    differences = powers.double()
    for _ in range(5):
        differences = differences.diff()
    assert abs(differences.item()) < 1e-4 * powers[5].item()
    assert powers.double().diff().diff()[0] > 0.01 * powers[1]
    assert len(pair.trace.vertices) == MAX_DEPTH - 1
    assert all(len(vertex.lit[unit].path) > 0 for vertex in pair.trace.vertices for unit in pair.materials)


def test_coverage_counts_the_paths_that_meet_an_object_first(pair):
    floor, ball = pair.trace.coverage(0), pair.trace.coverage(1)
    none = (pair.trace.first < 0).float().view(HEIGHT, WIDTH, SAMPLES).mean(2)
    assert torch.allclose(floor + ball + none, torch.ones(HEIGHT, WIDTH))
    assert ball[3, 4] == 1 and ball[:, 0].max() == 0 and floor[-1, 0] == 1
    # The ball, of radius 1 at a distance of 5.24, in a view 36 degrees wide.
    angle, wide = np.arcsin(1 / np.hypot(5, 1.2)), np.tan(np.radians(18))
    assert ball.sum().item() == pytest.approx(np.pi * (np.tan(angle) / wide * WIDTH / 2) ** 2, rel=0.02)


def test_angles_are_in_range_and_paths_in_order(sheet):
    for vertex in sheet.trace.vertices:
        assert vertex.met.shape == sheet.trace.seen.shape
        for part in (vertex.lit, vertex.onward):
            for queries in part.values():
                h, d, p = queries.angles
                assert min(h.min(), d.min(), p.min()) >= 0
                assert max(h.max(), d.max()) < np.pi / 2 + 1e-5 and p.max() < np.pi + 1e-5
                assert queries.factor.shape == (len(queries.path), 3) and (queries.factor >= 0).all()
                assert (queries.path.diff() > 0).all() and queries.path.max() < len(sheet.trace.first)


def joined(queries, count):
    """Return the angles (n, 3) and factors (n,) of all paths, 0 where nothing was asked."""
    angles, factor = torch.zeros(count, 3), torch.zeros(count)
    angles[queries.path], factor[queries.path] = torch.stack(queries.angles, 1), queries.factor[:, 0]
    return angles, factor


def test_a_mask_splits_queries_between_two_materials(plain, blended):
    """Both traces have the same first vertices, as their seeds and the densities of diffuse materials are the same."""
    count = len(plain.trace.first)
    one, other = (joined(blended.trace.vertices[0].lit["ball", k], count) for k in (0, 1))
    angles, factor = joined(plain.trace.vertices[0].lit["ball", 0], count)
    same = torch.isclose(one[1] + other[1], factor, rtol=1e-4, atol=1e-5)
    assert same.float().mean() > 0.99  # a rounding error may choose another light
    both = same & (one[1] > 0) & (other[1] > 0)
    assert both.float().mean() > 0.1
    assert torch.allclose(one[0][both], angles[both], atol=2e-3)
    assert torch.allclose(one[0][both], other[0][both], atol=2e-3)
    share = (other[1] / factor)[same & (factor > 0)]
    assert share.mean().item() == pytest.approx(texture(MASKS, "spots").mean(), abs=0.03)
    assert share.min() < 0.01 and share.max() > 0.99


def test_masks_split_queries_among_three_materials(plain, case, grey):
    """The last mask lies on top: the first material's share is what both masks leave of it."""
    objects = {"ball": ("sphere", ["a", "b", "c"], {"masks": ["spots", "veins"]})}
    trace = case(objects, {("ball", 0): grey(0.8), ("ball", 1): grey(0.1), ("ball", 2): grey(0.5)}).trace
    count = len(plain.trace.first)
    parts = torch.stack([joined(trace.vertices[0].lit["ball", k], count)[1] for k in range(3)])
    factor = joined(plain.trace.vertices[0].lit["ball", 0], count)[1]
    same = torch.isclose(parts.sum(0), factor, rtol=1e-4, atol=1e-5) & (factor > 0)
    assert same.float().mean() > 0.99 * (factor > 0).float().mean()
    spots, veins = (texture(MASKS, name) for name in ("spots", "veins"))
    expected = [((1 - spots) * (1 - veins)).mean(), (spots * (1 - veins)).mean(), veins.mean()]
    assert (parts / factor)[:, same].mean(1).tolist() == pytest.approx(expected, abs=0.04)


def test_a_normal_map_turns_the_directions_of_queries(plain, dented):
    count = len(plain.trace.first)
    smooth, rough = (joined(case.trace.vertices[0].lit["ball", 0], count)[0] for case in (plain, dented))
    asked = (smooth != 0).any(1) & (rough != 0).any(1)
    turned = (smooth - rough).abs()[asked]
    assert (turned[:, 0] > 0.02).float().mean() > 0.5
    # The angle between light and view doesn't depend on the normal; Mitsuba turns normals that face away from the view.
    assert (turned[:, 1] < 2e-3).float().mean() > 0.85


def doubled(trace):
    """Return a Trace with float64 numbers."""

    def queries(part):
        return {unit: dataclasses.replace(found, factor=found.factor.double()) for unit, found in part.items()}

    vertices = [
        dataclasses.replace(v, lit=queries(v.lit), onward=queries(v.onward), met=v.met.double()) for v in trace.vertices
    ]
    return dataclasses.replace(trace, seen=trace.seen.double(), vertices=vertices)


def test_importance_is_the_derivative_of_the_picture_as_shown(pair):
    exposure = 3.0  # with some pixels beyond 1

    def shown(values):
        linear = trace64.picture(replay(trace64, values)) * exposure
        curve = torch.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear.clamp_min(1e-9) ** (1 / 2.4) - 0.055)
        return torch.where(linear > 1, 1 + 1.055 / 2.4 * (1 - 1 / linear), curve).sum().item()

    trace64 = doubled(pair.trace)
    values = {key: value.double() for key, value in queried(pair.trace, pair.materials).items()}
    linear = pair.trace.picture(again(pair)) * exposure
    bright = (linear > 1).all(2).flatten().repeat_interleave(SAMPLES)
    assert bright.any() and not bright.all()
    found = importance(pair.trace, pair.materials, exposure)
    assert set(found) == set(pair.materials)
    for unit, (angles, value, weight) in found.items():
        keys = [key for key in values if key[2] == unit]
        assert value.shape == weight.shape == (len(angles[0]), 3)
        assert torch.equal(value, torch.cat([values[key] for key in keys]).float())
        start = 0
        for key in keys:
            part = weight[start : start + len(values[key])]
            start += len(values[key])
            over = bright[getattr(pair.trace.vertices[key[0]], key[1])[unit].path]
            assert part[over].any() or not over.any()
            for most in (part, part * over[:, None]):  # of all pixels, and of those that are overexposed
                if not most.any():
                    continue
                at = divmod(int(most.argmax()), 3)
                step = 1e-3 * values[key][at].item()
                high, low = (dict(values) for _ in range(2))
                for moved, sign in ((high, 1), (low, -1)):
                    moved[key] = values[key].clone()
                    moved[key][at] += sign * step
                assert part[at].item() == pytest.approx((shown(high) - shown(low)) / (2 * step), rel=2e-3)


def test_the_same_seed_gives_the_same_trace(layout, grey):
    made = layout({"ball": ("sphere", ["a"], {})})
    composition = compose(made, {("ball", 0): grey(0.8).plugin(None)}, 4, 3)
    first, second, other = (trace(composition, made, 4, seed) for seed in (0, 0, 1))
    asked = [t.vertices[0].lit["ball", 0] for t in (first, second, other)]
    assert torch.equal(asked[0].path, asked[1].path) and torch.equal(asked[0].factor, asked[1].factor)
    assert len(asked[0].path) != len(asked[2].path) or not torch.equal(asked[0].factor, asked[2].factor)


SCALAR = """
import json, sys, torch
from neumat.render import variant
variant._renders = lambda name, **environment: False
from neumat.render.mitsuba_scene import mitsuba
assert mitsuba().variant() == "scalar_rgb"
from neumat.scenes.compose import compose
from neumat.scenes.models import Model
from neumat.scenes.pictures import render
from neumat.scenes.replay import queried, replay
from neumat.scenes.trace import trace
layout, models = json.loads(sys.argv[1])
models = {(name, k): Model(rung, torch.tensor(numbers)) for name, k, rung, numbers in models}
composition = compose(layout, {unit: model.plugin(None) for unit, model in models.items()}, 4, 3)
found = trace(composition, layout, 8)
radiance = replay(found, queried(found, {unit: model.material for unit, model in models.items()}))
pixels = radiance.view(12, 8, 3)
units = [[sorted(vertex.lit), sorted(vertex.onward)] for vertex in found.vertices]
print(json.dumps([
    list(radiance.shape), units, found.first.tolist(), pixels.mean((0, 1)).tolist(),
    ((pixels.var(1) / 8).sum(0).sqrt() / 12).tolist(), found.picture(radiance).shape,
    render(composition, 32).mean((0, 1)).tolist(),
]))
"""


def test_the_scalar_variant_traces_and_renders_the_same(layout, grey, glossy):
    more = {"masks": ["checker"], "normals": "hammered"}
    made = layout({"floor": ("plane", ["a"], {}), "sheet": ("drape", ["a", "b"], more)})
    models = {("floor", 0): grey(0.5), ("sheet", 0): glossy, ("sheet", 1): grey(0.2)}
    told = json.dumps([made, [(*unit, model.rung, model.numbers.tolist()) for unit, model in models.items()]])
    answer = subprocess.run([sys.executable, "-c", SCALAR, told], check=True, capture_output=True, text=True).stdout
    shape, units, first, mean, error, picture, rendered = json.loads(answer.splitlines()[-1])
    composition = compose(made, {unit: model.plugin(None) for unit, model in models.items()}, 4, 3)
    compiled = trace(composition, made, 64)
    radiance = replay(compiled, queried(compiled, {unit: model.material for unit, model in models.items()}))
    assert shape == [12 * 8, 3] and picture == [3, 4, 3]
    assert len(units) == len(compiled.vertices)
    everything = [list(unit) for unit in sorted(models)]
    assert units[0] == [everything, everything]
    share = [np.mean(np.array(which) == k) for k in (-1, 0, 1) for which in (first, compiled.first.numpy())]
    assert np.allclose(share[::2], share[1::2], atol=0.1)
    expected = radiance.mean(0).numpy()
    assert (np.array(error) < 0.15 * expected).all()
    assert (np.abs(np.array(mean) - expected) < 4 * np.array(error)).all()
    assert (np.abs(np.array(rendered) - expected) < 2 * np.array(error)).all()  # of 4 times as many samples
