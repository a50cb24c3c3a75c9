"""How near a fitted BTF comes to pictures that it has not seen."""

import numpy as np
import pytest
import torch

from neumat.btf.pairs import held_out_pairs
from neumat.btf.representations.base import Representation
from neumat.btf.representations.registry import make
from neumat.btf.store import BtfStore, write_btf
from neumat.studies import btf_quality
from neumat.studies.btf_quality import pair_errors, picture_at, quality, summary

SIZE = 16


def flat(light, features):
    """A Lambertian texel's value: its colour by the cosine of the light."""
    return features * light[:, 2:]


class Colours(Representation):
    """A flat surface with a colour at each texel."""

    def __init__(self, plane, darker=lambda view: 1.0):
        self.plane, self.size, self.darker = plane, tuple(plane.shape[:2]), darker

    def positional(self):
        return self.plane

    def _fit(self, store, seed, progress):
        raise NotImplementedError

    def _eval(self, features, light, view):
        return flat(light, features) * self.darker(view)


@pytest.fixture
def plane():
    return torch.rand(SIZE, SIZE, 3, generator=torch.Generator().manual_seed(0))


@pytest.fixture
def pictures(plane):
    light, view = held_out_pairs(6, 0, "report")
    values = torch.stack([plane * one[2] for one in light])
    return BtfStore.from_arrays(values, light[:, None], view[:, None], kind="pictures")


def test_a_perfect_fit_has_no_error(plane, pictures):
    errors = pair_errors(Colours(plane), pictures, 1.0)
    assert errors["flip"].max() < 0.01 and errors["dssim"].max() < 0.01 and errors["psnr"].min() > 45


def test_rings_are_of_the_views_angle(plane, pictures):
    """A model that is wrong for grazing views is wrong in the last ring only."""
    errors = pair_errors(Colours(plane, lambda view: (view[:, 2:] > np.cos(np.radians(50))) * 1.0), pictures, 1.0)
    row = summary(errors)
    assert row["flip_0_25"] < 0.01 and row["flip_25_50"] < 0.01 and row["flip_50_75"] > 0.1
    assert row["flip_worst"] == errors["flip"].max() and row["psnr_worst"] == errors["psnr"].min()


def test_a_smaller_plane_is_judged_at_the_pictures_size(plane):
    up = torch.tensor([0.0, 0.0, 1.0])
    centres = (torch.arange(SIZE) + 0.5) / SIZE
    slope = torch.stack([centres.expand(SIZE, -1), centres[:, None].expand(-1, SIZE), torch.ones(SIZE, SIZE)], -1)
    enlarged = picture_at(Colours(slope), up, up, 2 * SIZE)
    finer = (torch.arange(2 * SIZE) + 0.5) / (2 * SIZE)
    assert torch.allclose(enlarged[1:-1, 1:-1, 0], finer[1:-1].expand(2 * SIZE - 2, -1), atol=1e-5)
    assert torch.allclose(enlarged[1:-1, 1:-1, 1], finer[1:-1, None].expand(-1, 2 * SIZE - 2), atol=1e-5)
    assert torch.equal(picture_at(Colours(plane), up, up, SIZE), Colours(plane).picture(up, up))


def test_parts_are_judged_apart_and_pairs_of_figures_not_at_all(tmp_path, plane, pictures, monkeypatch):
    light, view = pictures.light, pictures.view
    values = pictures.values(torch.arange(6)).float()
    values[2:4] *= 0.5  # of the report
    values[4:] = 0  # of figures
    write_btf(tmp_path / "held.h5", light, view, SIZE, SIZE, values, kind="pictures")
    write_btf(tmp_path / "queries.h5", light[:4], view[:4], SIZE, SIZE, values[:4], kind="pictures")
    monkeypatch.setattr(btf_quality, "load_representation", lambda path: Colours(plane))
    monkeypatch.setattr(btf_quality, "QUERIES", 1024)
    rows = quality("model", tmp_path / "queries.h5", tmp_path / "held.h5", {"validation": 2, "report": 2}, 0)
    rows = rows.set_index("pairs")
    assert list(rows.index) == ["validation", "report"]
    assert rows.loc["validation", "flip"] < 0.01 < 0.05 < rows.loc["report", "flip"]
    assert (rows["ns"] > 0).all()


def test_the_null_knows_no_position(pictures):
    mean = make("mean", {"samples": 2000}).fit(pictures, 0)
    picture = mean.picture(pictures.light[0, 0], pictures.view[0, 0])
    assert torch.equal(picture, picture[:1, :1].expand_as(picture))
