"""What people are shown: fireflies go, everything else stays."""

import numpy as np

from neumat.scenes.pictures import without_fireflies

RAMP = np.broadcast_to(np.linspace(0.1, 0.9, 20, dtype=np.float32)[:, None], (12, 20, 3))


def with_spots(*spots):
    """Return the ramp with pixels (row, column) at 50."""
    picture = RAMP.copy()
    for spot in spots:
        picture[*spot] = 50.0
    return picture


def test_a_lone_bright_pixel_becomes_what_is_around_it():
    for spot in ((5, 9), (0, 0), (11, 19)):
        found = without_fireflies(with_spots(spot))
        assert np.abs(found - RAMP).max() < 0.05


def test_two_side_by_side_go_too():
    assert np.abs(without_fireflies(with_spots((5, 9), (6, 10))) - RAMP).max() < 0.05


def test_gradients_edges_and_glints_of_some_pixels_stay():
    glint = with_spots((5, 9), (5, 10), (6, 9), (6, 10))
    edge = RAMP.copy()
    edge[:, 10:] = 40.0
    for picture in (RAMP, glint, edge):
        assert np.array_equal(without_fireflies(picture), picture)
