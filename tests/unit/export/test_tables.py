"""The formats of tables: read back they are the field; and Mitsuba's own plugin renders it as we do."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from neumat.brdf.coordinates import above_horizon, cosines, grid_angles
from neumat.brdf.rgl import Rgl
from neumat.brdf.table import Table
from neumat.export import export, read_material
from neumat.fields.distill import read_teachers
from neumat.fields.field import Field
from neumat.render.mitsuba_scene import render_bsdf
from neumat.render.scene import to_srgb8
from neumat.render.sphere import FrozenSphere, radiance_fields

SIZE = 48  # of the pictures
PUBLISHED = Path(__file__).parents[4] / "shared" / "data" / "nbrdf" / "merl_nbrdf.zip"
MATERIALS = {  # arguments of the fixture `field`: from matte to a mirror, half of whose peak is lost within 0.7 degrees
    "matte": {"albedo": (0.6, 0.3, 0.1)},
    "glossy": {"albedo": 0.1, "peak": 2.0, "fall": 8.0},
    "mirror": {"albedo": 0.02, "peak": 100.0, "fall": 60.0},
}


@pytest.fixture(scope="module")
def sphere():
    return FrozenSphere(SIZE)


def compare(sphere, weights, path):
    """Return (dB between 8-bit sRGB pictures, brightness as a multiple of ours) of Mitsuba's `measured`."""
    ours = radiance_fields(sphere, weights[None])[0]
    theirs = torch.from_numpy(render_bsdf({"type": "measured", "filename": str(path)}, SIZE, 256))
    error = (to_srgb8(ours).double() - to_srgb8(theirs).double()).square().mean()
    on_sphere = sphere.coverage.view(SIZE, SIZE) == 1
    return 10 * torch.log10(255**2 / error), theirs[on_sphere].mean() / ours[on_sphere].mean()


@pytest.mark.parametrize("name", MATERIALS)
def test_mitsubas_measured_renders_it_as_we_do(sphere, field, tmp_path, name):
    weights = field(**MATERIALS[name])
    psnr, brightness = compare(sphere, weights, export(weights, "rgl", tmp_path, name))
    assert psnr > 40
    assert abs(brightness - 1) < 0.003


@pytest.mark.skipif(not PUBLISHED.is_file(), reason="the published NBRDFs are not on this machine")
@pytest.mark.parametrize("name", ["white-fabric", "alum-bronze", "blue-acrylic", "chrome"])
def test_mitsubas_measured_renders_measured_materials_as_we_do(sphere, tmp_path, name):
    names, weights = read_teachers(PUBLISHED)
    psnr, brightness = compare(
        sphere, weights[names.index(name)], export(weights[names.index(name)], "rgl", tmp_path, name)
    )
    assert psnr > 40
    assert abs(brightness - 1) < 0.003


@pytest.mark.parametrize("format", ["merl", "rgl"])
def test_lambert_stays_lambert(field, tmp_path, format):
    albedo = torch.tensor([0.5, 0.2, 0.0])
    table = read_material(export(field(albedo=albedo), format, tmp_path, "grey"))
    assert isinstance(table, Table)
    entries = above_horizon().nonzero()[::997, 0]
    cos_i, cos_o = cosines(*grid_angles(entries))
    # Interpolation of f cos(theta_o) bends at the horizon.
    inside = entries[(cos_i > 0.2) & (cos_o > 0.2)] if format == "rgl" else entries
    expected = (albedo / torch.pi).expand(len(inside), 3)
    torch.testing.assert_close(table.values[inside], expected, rtol=0.02 if format == "rgl" else 1e-6, atol=1e-9)
    assert torch.equal(table.valid, above_horizon())


@pytest.mark.parametrize(("format", "tolerance"), [("merl", 1e-6), ("rgl", 0.01)])
@pytest.mark.parametrize("name", MATERIALS)
def test_table_is_the_field(field, tmp_path, name, format, tolerance):
    weights = field(**MATERIALS[name])
    table = read_material(export(weights, format, tmp_path, name))
    entries = above_horizon().nonzero()[::53, 0]
    difference = torch.log1p(table.values[entries]) - torch.log1p(Field(weights).eval(*grid_angles(entries)))
    assert difference.abs().mean() < tolerance


def test_a_channel_permutation_stays_one(field, tmp_path):
    red, blue = (
        Rgl(export(field(albedo=albedo, peak=2.0), "rgl", tmp_path, name)).rgb
        for name, albedo in {"red": (0.5, 0.1, 0.2), "blue": (0.2, 0.1, 0.5)}.items()
    )
    torch.testing.assert_close(red.flip(-1), blue, rtol=1e-5, atol=1e-7)


def test_black_is_written_and_rendered(tmp_path):
    path = export(torch.zeros(675), "rgl", tmp_path, "black")
    assert np.isfinite(render_bsdf({"type": "measured", "filename": str(path)}, 8, 4)).all()


def test_measured_renders_in_scalar_rgb_without_our_code(field, tmp_path):
    path = export(field(**MATERIALS["glossy"]), "rgl", tmp_path, "glossy")
    code = (
        "import sys, numpy as np, mitsuba as mi; mi.set_variant('scalar_rgb');"
        "s = mi.load_dict({'type': 'scene', 'i': {'type': 'path'}, 'e': {'type': 'constant'}, 's': {'type': 'sphere',"
        "'b': {'type': 'measured', 'filename': sys.argv[1]}}, 'c': {'type': 'perspective', 'to_world':"
        "mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]), 'f': {'type': 'hdrfilm', 'width': 8,"
        "'height': 8}}}); image = np.array(mi.render(s, spp=16)); assert 0.1 < image[4, 4].min() < 1, image[4, 4];"
        "assert 'torch' not in sys.modules and 'neumat' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, str(path)], check=True)
