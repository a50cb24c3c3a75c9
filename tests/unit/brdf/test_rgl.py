from pathlib import Path

import numpy as np
import pytest
import torch

from neumat.brdf.coordinates import above_horizon
from neumat.brdf.merl import read_folder
from neumat.brdf.rgl import MAGIC, SUFFIX, Rgl, check_rgl, read_rgl, read_tensors
from neumat.brdf.table import Table
from neumat.brdf.validity import directional_albedo
from neumat.errors import NeumatError
from neumat.seeds import numpy_generator

FOLDER = Path(__file__).parents[4] / "shared" / "data" / "rgl"
NAMES = ["cc_ibiza_sunset_rgb", "paper_white_rgb", "satin_rosaline_rgb"]
measured = pytest.mark.skipif(not FOLDER.is_dir(), reason="the measured RGL files are not on this machine")


def random_directions(generator, n):
    w = generator.normal(size=(n, 3))
    w[:, 2] = np.abs(w[:, 2]) + 1e-2
    return w / np.linalg.norm(w, axis=1, keepdims=True)


@pytest.fixture
def mi():
    """Mitsuba as scalar_rgb, and afterwards as it was: other tests set other variants."""
    mitsuba = pytest.importorskip("mitsuba")
    before = mitsuba.variant()
    mitsuba.set_variant("scalar_rgb")
    yield mitsuba
    if before:
        mitsuba.set_variant(before)


@measured
@pytest.mark.parametrize("name", NAMES)
def test_agrees_with_mitsuba(mi, name):
    path = FOLDER / f"{name}.bsdf"
    generator = numpy_generator(0, "rgl", name)
    wi = random_directions(generator, 1000)
    wo = random_directions(generator, 1000)
    wo[:500] = wi[:500] * [-1, -1, 1] + 0.1 * wo[:500]  # half of the pairs near the mirror direction
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
    si = mi.SurfaceInteraction3f()
    expected = []
    for i, o in zip(wi, wo, strict=True):
        si.wi = mi.Vector3f(i)
        expected.append(np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(o))))
    expected = np.maximum(expected, 0)  # the plugin passes negative measurements on
    found = Rgl(path).reflected(torch.tensor(wi), torch.tensor(wo)).numpy()
    np.testing.assert_allclose(found, expected, rtol=5e-4, atol=1e-6)


@measured
@pytest.mark.parametrize("name", NAMES)
def test_resampled_table_is_plausible(name):
    values = read_rgl(FOLDER / f"{name}.bsdf")
    np.testing.assert_array_equal(~np.isnan(values[:, 0]), above_horizon().numpy())
    assert np.nanmin(values) >= 0
    assert np.nanmax(values) < 1e4  # not blown up where a cosine vanishes
    # White paper reflects most of the light, the dark film little; none creates energy.
    albedo = directional_albedo(Table(values), 0.5)
    assert (albedo < 1).all()
    assert (albedo > 0.6).all() or name != "paper_white_rgb"


@measured
def test_bad_files(tmp_path):
    path = tmp_path / "a.bsdf"
    with pytest.raises(NeumatError, match="no such file"):
        read_rgl(path)
    path.write_bytes(b"something else")
    with pytest.raises(NeumatError, match="another kind of file"):
        read_rgl(path)
    whole = (FOLDER / f"{NAMES[1]}.bsdf").read_bytes()
    for size in (len(MAGIC) + 2, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(NeumatError, match="truncated or damaged") as caught:
            read_rgl(path)
        assert "\n" not in str(caught.value)
    path.write_bytes(whole.replace(b"rgb", b"rgx"))
    with pytest.raises(NeumatError, match="no field rgb"):
        read_rgl(path)
    nan = np.float32(np.nan).tobytes()
    ndf = read_tensors(FOLDER / f"{NAMES[1]}.bsdf")["ndf"][0, :8].tobytes()
    path.write_bytes(whole.replace(ndf, nan + ndf[4:]))
    with pytest.raises(NeumatError, match="finite values in field ndf"):
        read_rgl(path)


@measured
def test_folder():
    assert list(read_folder(FOLDER, SUFFIX, check_rgl)) == NAMES
