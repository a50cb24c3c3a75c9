import subprocess
import sys

import numpy as np
import pytest
import torch

from neumat.fields.layout import SIZE
from neumat.render import mitsuba_scene as ms
from neumat.render import scene
from neumat.render.sphere import FrozenSphere
from neumat.render.variant import variant
from neumat.seeds import torch_generator
from neumat.studies.renderers import verify


@pytest.fixture(scope="module")
def weights():
    return 0.2 * torch.randn(2, SIZE, generator=torch_generator(1, "test_mitsuba"))


def few(many, one):
    """Return `many` where Mitsuba is compiled, `one` where it runs Python per sample."""
    return one if variant() == "scalar_rgb" else many


def test_two_programs_agree_on_the_same_field(weights):
    size, spp = few((64, 256), (12, 64))
    table = verify(FrozenSphere(size), {"a": weights[0], "b": weights[1]}, spp=spp)
    assert (table.psnr > few(38, 25)).all()
    assert (abs(table.brightness - 1) < few(0.005, 0.05)).all()


def test_a_grey_sphere_of_mitsubas_own_agrees_with_ours():
    sphere = FrozenSphere(32)
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
    theirs = torch.from_numpy(ms.render_bsdf(grey, 32, 256))
    ours = sphere.pictures(torch.full((1, 3, len(sphere.theta_h)), 0.5 / np.pi))[0]
    on_sphere = sphere.coverage.view(32, 32) == 1
    assert torch.allclose(ours[on_sphere], theirs[on_sphere], atol=0.02)
    assert abs(ours[on_sphere].mean() / theirs[on_sphere].mean() - 1) < 0.003


def test_contact_sheet_has_its_tiles_in_reading_order(weights):
    size = few(16, 4)
    sheet = ms.render_grid(weights, columns=3, size=size, spp=4)
    assert sheet.dtype == np.uint8 and sheet.shape == (size, 3 * size, 3)
    empty = scene.to_srgb8(torch.tensor(ms.SHEET_BACKGROUND), 1.0).item()
    assert (sheet[:, 2 * size :] == empty).all()
    assert (sheet[:, :size] != empty).any() and (sheet[:, size : 2 * size] != empty).any()


def test_studio_is_never_dark():
    directions = torch.nn.functional.normalize(torch.randn(10_000, 3, generator=torch_generator(0, "d")), dim=-1)
    assert ms.studio(directions).min() > 0.1


def test_without_llvm_the_scalar_variant_renders():
    code = (
        "import numpy as np, torch; from neumat.render import mitsuba_scene as ms, variant;"
        "variant._renders = lambda name, **environment: False; assert variant.variant() == 'scalar_rgb';"
        "assert np.isfinite(ms.render_mitsuba(torch.linspace(-0.2, 0.2, 675), 8, 16)).all()"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
