"""What the tests of the exports share."""

import pytest
import torch

from neumat.brdf.coordinates import rusinkiewicz
from neumat.fields.layout import SIZE
from neumat.seeds import torch_generator


@pytest.fixture(scope="session")
def random_field():
    """Weights (675,) of a field that is no material: every weight counts."""
    return 0.3 * torch.randn(SIZE, generator=torch_generator(3, "export"))


@pytest.fixture(scope="session")
def pairs():
    """Unit directions (wi, wo), (n, 3) float32: anywhere, about the mirror direction, grazing, below the horizon.

    None of them within a thousandth of the plane of incidence, where phi_d jumps from pi to 0.
    """
    generator = torch_generator(4, "pairs")
    wi, wo = torch.randn(2, 4000, 3, generator=generator)
    wi[:3000, 2].abs_(), wo[:3000, 2].abs_()
    wi[:500, 2] *= 1e-3
    wi, wo = (torch.nn.functional.normalize(w, dim=1) for w in (wi, wo))
    wo[1000:2000] = wi[1000:2000] * torch.tensor([-1.0, -1.0, 1.0]) + 0.01 * wo[1000:2000]
    wo[1000:2000] = torch.nn.functional.normalize(wo[1000:2000], dim=1)
    keep = torch.sin(rusinkiewicz(wi, wo)[2]) > 1e-3
    return wi[keep], wo[keep]
