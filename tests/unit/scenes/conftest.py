"""The layouts and models that the tests of scenes share."""

import pytest
import torch

from neumat.scenes.models import Model


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """Batches are small: where other programs run, two threads mostly wait for each other."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture(scope="session")
def layout():
    """A layout of objects {name: (shape, its materials, whatever else it has)}."""

    def make(objects, light="studio"):
        plain = {"at": [0.0, 0.0], "size": 1.0, "turn": 0.0, "repeat": 2.0, "depth": 0.02}
        plain |= {"masks": [], "bump": None, "normals": None}
        return {
            "light": light,
            "exposure": 1.0,
            "camera": {"at": [0.0, 2.2, 5.0], "towards": [0.0, 0.8, 0.0], "fov": 36.0},
            "objects": {
                name: plain | {"shape": shape, "materials": materials} | more
                for name, (shape, materials, more) in objects.items()
            },
        }

    return make


@pytest.fixture(scope="session")
def grey():
    """A diffuse Model of one albedo."""
    return lambda albedo: Model("lambert", torch.full((3,), albedo))


@pytest.fixture(scope="session")
def glossy():
    return Model("glossy", torch.tensor([0.3, 0.1, 0.05, 0.04, 0.05, 0.06, 0.3]))
