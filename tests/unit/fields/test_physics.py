import math

import pytest
import torch

from neumat.fields.field import Field
from neumat.fields.layout import SIZE, unpack
from neumat.fields.mirrored import unfolded_error
from neumat.fields.physics import largest_albedo, physics_table, unfolded_table
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


def test_what_programs_show_that_do_not_fold(leaning):
    table = unfolded_table({"one": leaning(0.0)[None], "other": torch.stack([leaning(0.0), leaning(1.0)])})
    assert list(table["materials"]) == [1, 2] and list(table["above_10_percent"]) == [0, 1]
    assert table["worst"][0] < 1e-6 < 0.2 < table["worst"][1] < 0.6
    checked = unfolded_error(leaning(1.0)[None]).item()  # where samples are mended and refused
    reported = unfolded_table({"one": leaning(1.0)[None]})["worst"].item()
    assert reported == pytest.approx(checked, rel=0.1) and reported != checked
    broken = unfolded_table({"broken": torch.full((2, SIZE), math.nan)})
    assert broken["above_10_percent"].item() == 2
