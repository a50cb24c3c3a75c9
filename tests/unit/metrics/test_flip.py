import numpy as np
import pytest

from neumat.metrics.flip import flip
from neumat.seeds import numpy_generator


@pytest.fixture
def picture():
    """A grey picture (32, 48, 3), uint8, with some noise."""
    return numpy_generator(0, "picture").integers(100, 140, (32, 48, 3), np.uint8)


def test_identical_pictures_differ_in_nothing(picture):
    found = flip(picture, picture.copy())
    assert found.shape == picture.shape[:2] and found.max() < 1e-6


def test_errors_lie_where_the_pictures_differ_and_grow_with_the_difference(picture):
    errors = []
    for change in (5, 20, 80):
        other = picture.copy()
        other[:, :16] += np.uint8(change)
        found = flip(picture, other)
        assert 0 < found[:, :12].min() and found.max() <= 1
        assert found[:, 32:].max() < 0.01
        errors.append(found[:, :16].mean())
    assert errors[0] < 0.6 * errors[1] and errors[1] < 0.6 * errors[2]


def test_fine_detail_shows_more_where_the_picture_is_enlarged(picture):
    flat = np.full_like(picture, 128)
    dots = flat.copy()
    dots[::2, ::2] += np.uint8(40)
    dots[1::2, 1::2] -= np.uint8(40)
    found = [flip(flat, dots, enlarged).mean() for enlarged in (1.0, 2.0, 4.0)]
    assert found[1] > 1.3 * found[0] and found[2] > 1.3 * found[1]
