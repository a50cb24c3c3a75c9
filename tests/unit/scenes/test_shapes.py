import numpy as np
import pytest

from neumat.errors import NeumatError
from neumat.scenes.shapes import OPEN, SHAPES, mesh

CLOSED = [name for name in SHAPES if name not in ("plane", *OPEN)]


@pytest.fixture(scope="module", params=SHAPES)
def name(request):
    return request.param


@pytest.fixture(scope="module")
def shape(name):
    return mesh(name)


def corners(shape):
    """Return the corners of the faces, three of (f, 3), float64."""
    return [shape.vertices[shape.faces[:, k]].astype(np.float64) for k in range(3)]


def areas(shape):
    """Return the area vectors (f, 3) of the faces."""
    a, b, c = corners(shape)
    return np.cross(b - a, c - a) / 2


def volume(shape):
    """Return the signed volume inside a closed shape: positive where its faces are counterclockwise from outside."""
    a, b, c = corners(shape)
    return float((np.cross(a, b) * c).sum() / 6)


def test_normals_are_unit_vectors_on_the_side_of_their_faces(shape):
    assert np.abs(np.linalg.norm(shape.normals, axis=1) - 1).max() < 1e-6
    faces = areas(shape)
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    agreement = np.stack([(faces * shape.normals[shape.faces[:, k]]).sum(1) for k in range(3)])
    assert agreement.min() > 0.4  # at the sharp foot and lip of the vase
    assert np.quantile(agreement, 0.01) > 0.97


def test_stands_on_the_plane(shape, name):
    low, high = shape.vertices.min(0), shape.vertices.max(0)
    assert -1e-6 < low[1] < 0.05
    if name != "plane":
        assert np.allclose((low + high)[[0, 2]] / 2, 0, atol=0.01)
        assert 1.5 < (high - low).max() < 2.6


def test_texture_coordinates_span_the_tile(shape, name):
    assert (shape.uv.min(0) == 0).all()
    assert (shape.uv.max(0) == (500 if name == "plane" else 1)).all()


def test_textures_are_not_mirrored(shape):
    """Seen from outside, u to the right and v upwards turn counterclockwise as the faces do."""
    a, b, c = (shape.uv[shape.faces[:, k]].astype(np.float64) for k in range(3))
    assert (np.cross(np.pad(b - a, ((0, 0), (0, 1))), np.pad(c - a, ((0, 0), (0, 1))))[:, 2] > 0).all()


@pytest.mark.parametrize("closed", CLOSED)
def test_closed_shapes_have_no_hole(closed):
    faces = areas(mesh(closed))
    assert np.abs(faces.sum(0)).max() < 1e-6 * np.linalg.norm(faces, axis=1).sum()


def test_volumes():
    found = {name: volume(mesh(name)) for name in CLOSED}
    assert found["sphere"] == pytest.approx(4 / 3 * np.pi, rel=1e-3)
    assert 0.9 * 1.6**3 < found["cube"] < 1.6**3  # its edges are round
    # By Pappus, a tube along the knot's centre line.
    t = 2 * np.pi * (np.arange(10_000) + 0.5) / 10_000
    along = np.stack([np.cos(t) + 4 * np.cos(2 * t), -np.sin(t) + 4 * np.sin(2 * t), -4.2 * np.cos(3 * t)])
    length = 0.36 * 2 * np.pi * np.linalg.norm(along, axis=0).mean()
    assert found["knot"] == pytest.approx(np.pi * 0.27**2 * length, rel=0.02)
    assert 0 < found["vase"] < 1  # its wall and foot only


def test_the_floor_and_the_sheet_face_the_camera():
    assert (areas(mesh("plane"))[:, 1] > 0).all()
    assert areas(mesh("drape"))[:, 2].sum() == pytest.approx(2.2**2, rel=1e-3)


def test_an_unknown_shape_ends_in_one_line():
    with pytest.raises(NeumatError, match=r"shape: expected one of plane, .*; found 'teapot'") as caught:
        mesh("teapot")
    assert "\n" not in str(caught.value)
