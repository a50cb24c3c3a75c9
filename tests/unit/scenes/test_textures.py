import numpy as np
import pytest

from neumat.errors import NeumatError
from neumat.scenes.textures import HEIGHTS, MASKS, SIZE, SLOPE, normal_map, texture

ALL = [(registry, name) for registry in (MASKS, HEIGHTS) for name in registry]


@pytest.mark.parametrize(("registry", "name"), ALL, ids=[name for _, name in ALL])
def test_values_fill_0_to_1_and_tile(registry, name):
    found = texture(registry, name)
    assert found.shape == (SIZE, SIZE) and found.dtype == np.float32
    assert 0 <= found.min() and found.max() <= 1 and np.ptp(found) > 0.7
    for axis in (0, 1):
        inside = np.abs(np.diff(found, axis=axis)).max()
        assert np.abs(found.take(0, axis) - found.take(-1, axis)).max() <= inside * 1.001 + 1e-6


@pytest.mark.parametrize("registry", [MASKS, HEIGHTS])
def test_an_unknown_texture_ends_in_one_line(registry):
    with pytest.raises(NeumatError, match=r"texture: expected one of .*; found 'tartan'") as caught:
        texture(registry, "tartan")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", HEIGHTS)
def test_a_normal_map_holds_unit_vectors(name):
    normals = 2 * normal_map(texture(HEIGHTS, name)) - 1
    assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() < 1e-6
    steepness = np.abs(normals[..., :2] / normals[..., 2:])
    assert steepness.max() == pytest.approx(SLOPE, rel=1e-4)


def test_a_flat_height_points_up():
    assert (normal_map(np.full((4, 4), 0.3, np.float32)) == np.array([0.5, 0.5, 1], np.float32)).all()


def test_normals_turn_away_from_what_rises():
    """Texels lie in rows: v grows downwards, u to the right."""
    at = np.arange(64) / 64
    for axis, height in enumerate(np.broadcast_arrays(np.sin(2 * np.pi * at), np.sin(2 * np.pi * at)[:, None])):
        normals = 2 * normal_map(height) - 1
        slope = np.cos(2 * np.pi * at).reshape((1, -1) if axis == 0 else (-1, 1))
        assert np.allclose(normals[..., axis] / normals[..., 2], -SLOPE * slope, atol=1e-5)
        assert np.allclose(normals[..., 1 - axis], 0, atol=1e-6)
