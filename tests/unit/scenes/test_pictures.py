"""What people are shown: fireflies go, everything else stays."""

import torch

from neumat.scenes.pictures import without_fireflies

RAMP = torch.linspace(0.1, 0.9, 20)[None, :, None].expand(12, 20, 3)


def with_spots(*spots):
    """Return the ramp with pixels (row, column) at 50."""
    picture = RAMP.clone()
    for spot in spots:
        picture[*spot] = 50.0
    return picture


def test_a_lone_bright_pixel_becomes_what_is_around_it():
    for spot in ((5, 9), (0, 0), (11, 19)):
        found = without_fireflies(with_spots(spot))
        assert (found - RAMP).abs().max() < 0.05


def test_two_side_by_side_go_too():
    assert (without_fireflies(with_spots((5, 9), (6, 10))) - RAMP).abs().max() < 0.05


def test_gradients_edges_and_glints_of_some_pixels_stay():
    glint = with_spots((5, 9), (5, 10), (6, 9), (6, 10))
    edge = RAMP.clone()
    edge[:, 10:] = 40.0
    for picture in (RAMP, glint, edge):
        assert torch.equal(without_fireflies(picture), picture)
