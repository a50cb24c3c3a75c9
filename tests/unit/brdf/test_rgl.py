from pathlib import Path

import numpy as np
import pytest
import torch

from neumat.brdf.coordinates import above_horizon
from neumat.brdf.merl import read_folder
from neumat.brdf.rgl import FIELDS, MAGIC, SUFFIX, Rgl, check_rgl, read_rgl, read_tensors
from neumat.brdf.table import Table, valid_entries
from neumat.brdf.validity import directional_albedo
from neumat.errors import NeumatError
from neumat.export.rgl import write_tensors
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


def made(seed, **changes):
    """Return the tensors of a small material, none in nature, of which all numbers count; None leaves a field out."""
    generator = numpy_generator(seed, "made")

    def positive(*shape):
        return generator.uniform(0.5, 1.5, shape).astype(np.float32)

    tensors = {
        "description": np.frombuffer(b"made", np.uint8),
        "phi_i": np.zeros(1, np.float32),
        "theta_i": np.linspace(0, np.pi / 2, 5, dtype=np.float32),
        "ndf": positive(3, 7),
        "sigma": positive(4, 6),
        "vndf": positive(1, 5, 6, 9),
        "luminance": positive(1, 5, 8, 8),
        "rgb": positive(1, 5, 3, 8, 8),
        "jacobian": np.ones(1, np.uint8),
    }
    return {key: value for key, value in (tensors | changes).items() if value is not None}


def both_phi(tensors):
    """Return the tensors with a second phi_i, at which every table is another one."""
    turned = {key: np.concatenate([tensors[key], tensors[key][:, ::-1]]) for key in ("vndf", "luminance", "rgb")}
    return tensors | turned | {"phi_i": np.array([-np.pi, np.pi], np.float32)}


# What the plugin `measured` takes, and what it doesn't; and what we don't, though it does.
TAKEN = {
    "plain": made(0),
    "no jacobian in the values": made(1, jacobian=np.zeros(1, np.uint8)),
    "jacobian of another number": made(1, jacobian=np.full(1, 7, np.uint8)),
    "2 phi_i": both_phi(made(2)),
    "2 phi_i, no jacobian": both_phi(made(3, jacobian=np.zeros(1, np.uint8))),
    "1 theta_i": {
        key: value[:1] if key == "theta_i" else value[:, :1] if value.ndim > 2 else value
        for key, value in made(4).items()
    },
}
REFUSED = {
    **{f"no {key}": made(0, **{key: None}) for key in FIELDS},
    **{f"{key} of another type": made(0, **{key: made(0)[key].astype(np.float64)}) for key in FIELDS},
    **{f"{key} of more dimensions": made(0, **{key: made(0)[key][None]}) for key in FIELDS},
    "jacobian of two": made(0, jacobian=np.ones(2, np.uint8)),
    "4 channels": made(0, rgb=np.ones((1, 5, 4, 8, 8), np.float32)),
    "rgb not square": made(0, rgb=np.ones((1, 5, 3, 8, 7), np.float32)),
    "luminance smaller": made(0, luminance=np.ones((1, 5, 7, 7), np.float32)),
    "another theta_i": made(0, theta_i=np.zeros(4, np.float32)),
    "no theta_i": made(0, theta_i=np.zeros(0, np.float32)),
    "another phi_i": made(0, phi_i=np.zeros(2, np.float32)),
    "ndf of one row": made(0, ndf=np.ones((1, 7), np.float32)),
    "vndf of one column": made(0, vndf=np.ones((1, 5, 6, 1), np.float32)),
    "spectral": made(0, spectra=made(0)["rgb"], wavelengths=np.array([450, 550, 650], np.float32)),
    "spectral without rgb": made(0, rgb=None, spectra=made(0)["rgb"], wavelengths=np.ones(3, np.float32)),
}
OURS = {
    "anisotropic": {key: np.repeat(value, 3, 0) if value.ndim > 2 else value for key, value in made(0).items()}
    | {"phi_i": np.array([-1, 0, 1], np.float32)},
    "falling theta_i": made(0, theta_i=made(0)["theta_i"][::-1]),
    "NaN": made(0, sigma=np.full((4, 6), np.nan, np.float32)),
    "vndf of 0": made(0, vndf=np.zeros((1, 5, 6, 9), np.float32)),
}


@pytest.mark.parametrize("name", TAKEN)
def test_what_mitsuba_takes_has_the_same_values(mi, tmp_path, name):
    write_tensors(tmp_path / "a.bsdf", TAKEN[name])
    compare(mi, tmp_path / "a.bsdf", name)


def test_two_phi_i_make_a_table(tmp_path):
    write_tensors(tmp_path / "a.bsdf", TAKEN["2 phi_i"])
    assert (valid_entries(read_rgl(tmp_path / "a.bsdf")) == above_horizon().numpy()).all()


@pytest.mark.parametrize("name", REFUSED | OURS)
def test_what_mitsuba_refuses_is_refused_in_one_line(mi, tmp_path, name):
    write_tensors(tmp_path / "a.bsdf", (REFUSED | OURS)[name])
    if name in REFUSED:
        with pytest.raises(RuntimeError):
            mi.load_dict({"type": "measured", "filename": str(tmp_path / "a.bsdf")})
    with pytest.raises(NeumatError, match=r"a\.bsdf: expected") as caught:
        read_rgl(tmp_path / "a.bsdf")
    assert "\n" not in str(caught.value)


@measured
@pytest.mark.parametrize("name", NAMES)
def test_agrees_with_mitsuba(mi, name):
    compare(mi, FOLDER / f"{name}.bsdf", name)


def compare(mi, path, name):
    """Compare our values with those of Mitsuba's plugin `measured`, the witness."""
    generator = numpy_generator(0, "rgl", name)
    wi = random_directions(generator, 1000)
    # The plugin may turn the view into this quadrant, as it does for anisotropic materials: for isotropic ones it does
    # not set the variable that it asks. All that it does is seen from here.
    wi[:, :2] = -np.abs(wi[:, :2])
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
