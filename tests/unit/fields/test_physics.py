import math

import pytest
import torch

from neumat.fields.field import Field
from neumat.fields.layout import SIZE, unpack
from neumat.fields.physics import largest_albedo, physics_table, unfolded_brightness, unfolded_table
from neumat.fields.validity import directional_albedos
from neumat.seeds import torch_generator


def test_albedo_and_gain_of_diffuse_materials(field):
    table = physics_table(["half", "double"], torch.stack([field(0.5), field(2.0)])).set_index("material")
    assert list(table.index) == ["double", "half"]
    assert table["albedo"]["half"] == pytest.approx(0.5, rel=0.01)
    assert table["gain"]["double"] == pytest.approx(1, rel=0.02) and table["gain"]["half"] == 0
    assert table["flagged"]["double"] and not table["flagged"]["half"]
    assert table["rescale"]["double"] == pytest.approx(0.5, rel=0.02) and table["rescale"]["half"] == 1


def test_every_field_is_reciprocal():
    weights = 0.3 * torch.randn(4, SIZE, generator=torch_generator(0, "physics"))
    assert (physics_table(range(4), weights)["reciprocity"] < 1e-4).all()


def test_a_field_that_is_not_a_number_is_flagged(field):
    weights = torch.stack([field(0.5), torch.full((SIZE,), math.nan)])
    table = physics_table(["fine", "broken"], weights).set_index("material")
    assert table["flagged"]["broken"] and not table["flagged"]["fine"]


def test_largest_albedo_of_one_material_is_that_of_the_table(field):
    weights = field(0.3, 20.0, 40.0)
    table = physics_table(["a"], weights[None])
    assert largest_albedo(Field(weights)) == pytest.approx(table["largest_albedo"].item(), rel=0.01)


def test_light_that_is_gained_beyond_85_degrees_only_is_seen():
    weights = torch.zeros(SIZE)
    (w1, b1), (w2, _), (w3, _) = unpack(weights)
    # log(1 + f) falls linearly from 6 at theta_d = 90 degrees to 0 at 72.
    w1[5, 0], b1[0], w2[0, 0], w3[0] = -20.0, 6.0, 1.0, 1.0
    below, above = (directional_albedos(weights[None], [math.radians(angle)]).max() for angle in (85, 89.9))
    assert below < 1 < above
    assert largest_albedo(Field(weights)) > 1


def test_brightness_without_folding_is_that_of_the_mirrored_half():
    even, leaning = torch.zeros(2, SIZE)
    even[-3:] = 0.3
    (w1, _), (w2, _), (w3, b3) = unpack(leaning)
    # log(1 + f) is 0.3 where d_y >= 0, and falls with -d_y beyond.
    w1[4, 0], w2[0, 0], w3[0], b3[:] = -1.0, 1.0, -0.3, 0.3
    found = unfolded_brightness(torch.stack([even, leaning]))
    assert found[0] == pytest.approx(1, abs=1e-6)
    assert 0.4 < found[1] < 0.8
    table = unfolded_table({"both": torch.stack([even, leaning])})
    assert table["worst"].item() == pytest.approx(1 - found[1].item()) and table["above_10_percent"].item() == 1
    broken = unfolded_table({"broken": torch.full((2, SIZE), math.nan)})
    assert broken["above_10_percent"].item() == 2
