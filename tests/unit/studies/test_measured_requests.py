from pathlib import Path

import pytest
import torch

from neumat.render.scene import environment
from neumat.render.sphere import FrozenSphere
from neumat.studies.measured_requests import measured_pictures

FOLDER = Path(__file__).parents[4] / "shared" / "data" / "rgl"


@pytest.mark.skipif(not FOLDER.is_dir(), reason="needs the RGL files of the development data")
def test_measured_materials_are_pictured_under_each_light():
    def dimmer(directions):
        return environment(directions) / 2

    spheres = [FrozenSphere(16, 8, 16, environment=light) for light in (environment, dimmer)]
    names, bright, dim = measured_pictures(sorted(FOLDER.glob("*.bsdf")), *spheres)
    assert bright.shape == dim.shape == (len(names), 16, 16, 3)
    inside = (slice(None), slice(4, 12), slice(4, 12))
    assert torch.allclose(bright[inside], 2 * dim[inside], rtol=1e-4)
    paper = names.index("paper_white_rgb")
    assert bright[paper][4:12, 4:12].std(-1).mean() < 0.1 * bright[paper][4:12, 4:12].mean()  # white
