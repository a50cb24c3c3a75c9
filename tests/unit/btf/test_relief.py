"""Reliefs: closed forms of a plane, and parts that fit together."""

import numpy as np
import pytest

from neumat.btf.relief import height_range, relief


def test_a_plane_has_its_slopes_and_heights_everywhere(shape):
    found = relief(shape(lambda x, y: 0.3 * x - 0.2 * y), 8, range(2, 6), range(0, 4), 0.1, 3)
    assert np.allclose(found.slopes_x, 0.3) and np.allclose(found.slopes_y, -0.2)
    positions = found.positions
    corner = (0, 2 / 8)  # of the texels, in the surface
    assert np.allclose(
        positions[:, 2], 0.3 * (positions[:, 0] + corner[0]) - 0.2 * (positions[:, 1] + corner[1]), atol=1e-6
    )
    assert positions[:, 0].min() <= -0.1 and positions[:, 0].max() >= 0.5 + 0.1


def test_triangles_cover_the_relief_once_and_face_up(shape):
    found = relief(shape(), 4, range(4), range(3), 0.0, 2)
    assert len(found.faces) == 2 * 8 * 6
    a, b, c = (found.positions[found.faces[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)[:, 2] / 2
    assert (area > 0).all() and area.sum() == pytest.approx(0.75)
    first = found.positions[found.faces[2 * 7]][:, :2]  # quad 7: row 1, column 1
    assert np.allclose(first.min(0), 1 / 8)


def test_neighbouring_parts_share_their_vertices(waves):
    left, right = (relief(waves, 16, range(16), columns, 0.0) for columns in (range(8), range(8, 16)))
    for name in ("heights", "slopes_x", "slopes_y", "materials"):
        assert np.array_equal(getattr(left, name)[:, -1], getattr(right, name)[:, 0])


def test_range_is_that_of_the_heights(waves):
    assert height_range(waves) == pytest.approx((-0.02, 0.02), rel=0.01)
