"""An endless BTF: what a representation makes of synthesised features."""

import pytest
import torch

from neumat.btf.endless import EndlessBtf, pixel_centres
from neumat.btf.representations.base import Representation
from neumat.btf.synthesis import SYNTHESES

UP = torch.tensor([0.0, 0.0, 1.0])


class Features(Representation):
    """Its values are its features: what is seen is what synthesis gives."""

    def __init__(self, plane):
        self.plane, self.size = plane, plane.shape[:2]

    def positional(self):
        return self.plane

    def _fit(self, store, seed, progress):
        raise NotImplementedError

    def _eval(self, features, light, view):
        return features * light[:, 2:]


@pytest.fixture
def plane():
    return torch.rand(8, 8, 3, generator=torch.Generator().manual_seed(0))


def test_a_tiled_exemplar_at_its_own_texels_is_the_exemplar(plane):
    endless = EndlessBtf(Features(plane), SYNTHESES["tiling"](plane, 0, True))
    assert torch.allclose(endless.picture(UP, UP), plane, atol=1e-6)
    assert torch.allclose(endless.picture(UP, UP, (3.0, -2.0), 2), plane.repeat(2, 2, 1), atol=1e-6)


def test_a_picture_begins_at_its_origin_and_its_rows_go_with_y(plane):
    endless = EndlessBtf(Features(plane), SYNTHESES["tiling"](plane, 0, True))
    moved = endless.picture(UP, UP, (0.25, 0.5))
    assert torch.allclose(moved, plane.roll((-4, -2), (0, 1)), atol=1e-6)


def test_larger_pixels_see_the_mean_of_their_texels(plane):
    endless = EndlessBtf(Features(plane), SYNTHESES["tiling"](plane, 0, True))
    small = endless.picture(UP, UP, extent=1, pixels=4)
    assert torch.allclose(small, plane.view(4, 2, 4, 2, 3).mean((1, 3)), atol=1e-6)


def test_values_depend_on_the_light(plane):
    endless = EndlessBtf(Features(plane), SYNTHESES["tiling"](plane, 0, True))
    u = torch.rand(5, 2, dtype=torch.float64)
    light = torch.nn.functional.normalize(torch.tensor([[1.0, 0, 1]]), dim=1)
    assert torch.allclose(endless.eval(u, light, UP[None]), endless.eval(u, UP[None], UP[None]) * light[0, 2])


def test_pixel_centres_are_row_by_row():
    assert pixel_centres((1, 2), 2, 2).tolist() == [[1.5, 2.5], [2.5, 2.5], [1.5, 3.5], [2.5, 3.5]]
