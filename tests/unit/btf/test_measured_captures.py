"""Captures of measured BTFs: held-out pairs that nothing else sees, and values that are the pictures' own."""

import math

import pytest
import torch

from neumat.btf.directions import grid, rings, ubo2003_directions
from neumat.btf.measured_captures import split_pictures, write_measured_capture
from neumat.btf.representations.grid import regular_grid
from neumat.btf.store import BtfStore, read_btf
from neumat.errors import NeumatError

SIDE = 12
LIGHT, VIEW = grid(rings((0, 30, 60), (1, 6, 12)), ubo2003_directions()[::4])  # 19 views, 21 lights
SETTINGS = {
    "queries": {"sweeps": 30, "pairs": 50},
    "grid": {"theta": [0, 60], "count": [1, 4]},
    "held_out": {"validation": 3, "report": 7},
    "shown": [[40, 30, 0, 0], [55, 140, 60, -60]],
    "texels": None,
}


@pytest.fixture(scope="module")
def store():
    """Pictures of which each texel tells its number and the picture's."""
    number = torch.arange(len(LIGHT)).float()[:, None] / 1024
    texel = torch.arange(SIDE * SIDE).float() / 1024
    values = torch.stack([number.expand(-1, SIDE * SIDE), texel.expand(len(LIGHT), -1), number + texel], -1)
    values = values.view(-1, SIDE, SIDE, 3)
    return BtfStore.from_arrays(values, LIGHT[:, None], VIEW[:, None], kind="pictures", size_mm=7.0, partial=True)


@pytest.fixture
def taken(store, tmp_path):
    def take(capture, **changes):
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.h5"
        write_measured_capture(store, capture, SETTINGS | changes, {"file": "a.btf"}, 0, path)
        return read_btf(path)

    return take


def test_what_is_held_out_is_in_no_other_capture(store):
    parts = split_pictures(store, SETTINGS, 0)
    assert len(parts["held-out"]) == 12 and len(parts["held-out"].unique()) == 12
    for name in ("grid", "queries"):
        assert not torch.isin(parts[name], parts["held-out"]).any()
    assert len(parts["queries"]) == len(LIGHT) - 12
    assert torch.equal(parts["held-out"], split_pictures(store, SETTINGS, 0)["held-out"])
    assert not torch.equal(parts["held-out"], split_pictures(store, SETTINGS, 1)["held-out"])


def test_the_grid_has_every_view_under_every_light(taken):
    found = taken("grid")
    views, lights, _ = regular_grid(found, "grid")
    assert len(views) == 5 and len(lights) == 5 and found.sweeps == 25
    assert math.degrees(math.acos(views[:, 2].min())) == pytest.approx(60, abs=1)


def test_shown_pairs_are_the_last_and_the_nearest(taken):
    found = taken("held-out")
    light = torch.acos(found.light[-2:, 0, 2]).rad2deg()
    assert torch.allclose(light, torch.tensor([40.0, 55.0]), atol=16)
    assert found.size_mm == 7 and found.partial and found.surface == {"file": "a.btf"}


def test_each_value_of_the_queries_is_its_pictures_own_and_none_comes_twice(taken):
    found = taken("queries")
    assert found.kind == "queries" and (found.sweeps, found.pairs) == (30, 48)  # 48 divides 144, 50 doesn't
    values = found.values(range(30)).float().flatten(1, 2) * 1024
    number, texel = values[..., 0].round().long(), values[..., 1]
    assert torch.equal(texel, torch.arange(SIDE * SIDE).float().expand(30, -1))
    pair = torch.arange(SIDE * SIDE) % 48
    assert torch.equal(found.light[:, pair], LIGHT[number]) and torch.equal(found.view[:, pair], VIEW[number])
    assert all(len(each.unique()) == 30 for each in number.T)


def test_few_pictures_are_stored_as_they_are(taken, store):
    found = taken("queries", queries={"sweeps": 1000, "pairs": 50})
    assert found.kind == "pictures" and found.sweeps == len(LIGHT) - 12


def test_pictures_are_averaged_to_fewer_texels(taken, store):
    found, whole = taken("grid", texels=4), taken("grid")
    expected = whole.values([3])[0].float().view(4, 3, 4, 3, 3).mean((1, 3))
    assert torch.allclose(found.values([3])[0].float(), expected, atol=1e-3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"held_out": {"validation": 100, "report": 200}}, "at most 199 pairs"), ({"texels": 13}, "at most its own 12")],
)
def test_what_the_pictures_do_not_have_is_refused(taken, changes, words):
    with pytest.raises(NeumatError, match=words):
        taken("queries", **changes)
