import numpy as np
import pytest

from neumat.scenes.visible import object_errors


def test_an_objects_error_is_the_mean_over_its_pixels():
    errors = np.array([[0.1, 0.5], [0.2, 0.0]])
    coverage = {
        "corner": np.array([[0.0, 1.0], [0.0, 0.0]]),
        "edge": np.array([[0.25, 0.0], [0.75, 0.0]]),
        "all": np.ones((2, 2)),
        "absent": np.zeros((2, 2)),
    }
    found = object_errors(errors, coverage)
    assert found == pytest.approx({"corner": 0.5, "edge": 0.175, "all": 0.2, "absent": 0.0})
