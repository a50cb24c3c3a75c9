"""Bonn's .btf files: read as the format says, written so that others read them, and refused when they are broken."""

import logging
import math
import struct

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.btf.bonn import read_bonn
from neumat.btf.bonn_writer import write_dfmf
from neumat.btf.colour_models import DECODERS, ENCODERS
from neumat.btf.directions import grid, spherical, ubo2014_directions
from neumat.btf.measured import read_measured
from neumat.btf.store import BtfStore
from neumat.errors import NeumatError

LIGHTS = np.array([[0, 0], [0.5, 1], [0.5, 3], [1.3, 6]], np.float32)
VIEWS = np.array([[0, 0], [1, 2], [1, -2]], np.float32)
SIDE = 4
PICTURES, TEXELS = len(LIGHTS) * len(VIEWS), SIDE * SIDE


def header(signature=b"!DFMF08FCR", version=4, lights=None, side=(SIDE, SIDE), channels=3, size=0, density=2.0):
    """Return the bytes of a header; lights: of each view; size: what is added to the true length of the meta data."""
    meta = struct.pack("<I80s80s80sf3f", version, b"", b"", b"", density, 1, 1, 1)
    if version > 1:
        meta += struct.pack("<I", 0)
    if version > 2:
        meta += struct.pack("<I", 5) + b"<xml>"
    if version > 3:
        meta += struct.pack("<I", channels) + b"".join(struct.pack("<I", 2) + b"ch" for _ in range(channels))
    data = signature + struct.pack("<I", len(meta) + 4 + size) + meta + struct.pack("<I", len(VIEWS))
    for view, of_view in zip(VIEWS, lights or [LIGHTS] * len(VIEWS), strict=True):
        data += view.tobytes() + struct.pack("<I", len(of_view)) + of_view.tobytes()
    return data + struct.pack("<3I", *side, 1) + np.eye(3, dtype=np.float32).tobytes()


def factors(rows, columns, k=2, dtype="<f4", seed=0, scale=1.0):
    """Return two random factors (rows, k), (columns, k), and the bytes of a matrix of them."""
    draw = np.random.default_rng(seed)
    left, right = ((draw.random((n, k)) * scale).astype(dtype) for n in (rows, columns))
    data = struct.pack("<3I", k, rows, columns) + np.ones(k, dtype).tobytes() + left.tobytes() + right.tobytes()
    return left.astype(float), right.astype(float), data


def body(model=0, most=9, matrices=None, dtype="<f4", swapped=False):
    """Return the values (pictures, side, side, 3) and the bytes of a DFMF body."""
    data, values = struct.pack("<Ii12f", most, model, *[0] * 12), []
    rows, columns = (TEXELS, PICTURES) if swapped else (PICTURES, TEXELS)
    for channel in range(3):
        left, right, matrix = factors(rows, columns, 2 + channel, dtype, channel)
        values.append(right @ left.T if swapped else left @ right.T)
        data += struct.pack("<B", np.dtype(dtype).itemsize) + (matrices or {}).get(channel, matrix)
    return np.stack(values, -1).reshape(-1, SIDE, SIDE, 3), data


def read(path):
    """Return all pictures of a file, rows from the top as they lie in it, and its PictureSet."""
    pictures, _ = read_bonn(path)
    return torch.cat([pictures.read(part) for part in pictures.blocks()]).flip(1).numpy(), pictures


@pytest.fixture
def written(tmp_path):
    def write(*data):
        path = tmp_path / "some.btf"
        path.write_bytes(b"".join(data))
        return path

    return write


@pytest.mark.parametrize("version", [1, 2, 3, 4])
@pytest.mark.parametrize(("dtype", "swapped"), [("<f2", False), ("<f4", True), ("<f8", False)])
def test_a_dfmf_file_holds_products_of_its_factors(written, version, dtype, swapped):
    values, data = body(dtype=dtype, swapped=swapped)
    found, pictures = read(written(header(version=version), data))
    np.testing.assert_allclose(found, values, rtol=1e-5)
    assert pictures.side == SIDE and pictures.size_mm == SIDE / 2.0


def test_pictures_are_all_lights_of_the_first_view_then_of_the_second(written):
    _, pictures = read(written(header(), body()[1]))
    light, view = (spherical(*torch.from_numpy(angles).unbind(-1)) for angles in (LIGHTS, VIEWS))
    torch.testing.assert_close(pictures.light, light.repeat(len(VIEWS), 1))
    torch.testing.assert_close(pictures.view, view.repeat_interleave(len(LIGHTS), 0))


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize(("version", "logarithms"), [(0, False), (1, False), (1, True), (2, True)])
def test_an_fmf_file_holds_its_channels_in_one_matrix(written, swapped, version, logarithms):
    rows, columns = (3 * TEXELS, PICTURES) if swapped else (3 * PICTURES, TEXELS)
    left, right, matrix = factors(rows, columns)
    start = struct.pack("<B", version)
    if version >= 1:
        start += struct.pack("<I", logarithms)
    if version >= 2:
        start += struct.pack("<2I", 2, 3) + np.ones(6, "<f2").tobytes()
    found, _ = read(written(header(b"!FMF12FCER"), start, struct.pack("<IB", 2, 4), matrix))
    product = left @ right.T
    by_channel = product.reshape(TEXELS, 3, PICTURES).transpose(2, 0, 1) if swapped else (
        product.reshape(PICTURES, 3, TEXELS).transpose(0, 2, 1)
    )  # fmt: skip
    expected = np.exp(by_channel) - 1e-5 if logarithms else by_channel
    np.testing.assert_allclose(found, expected.reshape(-1, SIDE, SIDE, 3), rtol=1e-5)


YUV = np.array([0.4, 0.05, -0.03])
RGB = np.array([0.4 - 1.13983 * 0.03, 0.4 - 0.39465 * 0.05 + 0.5806 * 0.03, 0.4 + 2.03211 * 0.05])
EPSILON = 1e-5


@pytest.mark.parametrize(
    ("model", "channels", "expected"),
    [
        (0, YUV, YUV),
        (1, YUV, RGB),
        (9, [math.log(0.4 + EPSILON), 0.05, -0.03], RGB),
        (10, [math.log(0.4 + EPSILON), math.log(0.05 / EPSILON), -math.log(0.03 / EPSILON)], RGB),
        (11, [math.log(0.4 + EPSILON), 0.05 / (0.4 + EPSILON), -0.03 / (0.4 + EPSILON)], RGB),
        (12, np.log(RGB + EPSILON), RGB),
    ],
)
def test_colour_models_by_their_formulas(model, channels, expected):
    torch.testing.assert_close(
        DECODERS[model](*torch.tensor(np.array(channels), dtype=torch.float32)),
        torch.tensor(expected, dtype=torch.float32),
    )


@pytest.mark.parametrize("model", ENCODERS)
def test_colour_models_that_are_written_come_back(model):
    rgb = torch.rand(1000, 3, generator=torch.Generator().manual_seed(0)) ** 4
    rgb[0] = 0
    torch.testing.assert_close(DECODERS[model](*ENCODERS[model](rgb).unbind(-1)), rgb, rtol=1e-4, atol=1e-6)


def shaded(side=16, scale=1.0, specular=0.2):
    """Return a store of Lambertian bumps with a lobe, for 12 lights and 3 views, in float32."""
    light, view = grid(ubo2014_directions()[[0, 7, 60]], ubo2014_directions()[[*range(0, 7), 35, 40, 45, 130, 140]])
    x = (torch.arange(side) + 0.5) / side * 2 * math.pi
    wave = (x + 2 * x[:, None]).cos()
    by_x, by_y = -0.25 * wave, -0.5 * wave
    normal = torch.nn.functional.normalize(torch.stack([by_x, by_y, torch.ones(side, side)], -1), dim=-1)
    cos = torch.einsum("hwc,sc->shw", normal, light).clamp_min(0)
    half = torch.nn.functional.normalize(light + view, dim=-1)
    lobe = torch.einsum("hwc,sc->shw", normal, half).clamp_min(0) ** 20
    albedo = torch.tensor([0.7, 0.4, 0.1]) / math.pi
    values = scale * (albedo * cos[..., None] + specular * (lobe * cos)[..., None])
    return BtfStore.from_arrays(values, light[:, None], view[:, None], kind="pictures", size_mm=25.0)


@pytest.mark.parametrize(("model", "scalar"), [(11, 2), (11, 4), (0, 2), (0, 4)])
def test_what_is_written_is_read_and_by_pysmtb_as_well(tmp_path, model, scalar):
    pysmtb = pytest.importorskip("pysmtb.btf")
    store, path = shaded(), tmp_path / "ours.btf"
    write_dfmf(path, store, components=36, colour_model=model, scalar_size=scalar)
    values = store.values(range(36)).float().numpy()
    found, pictures = read(path)
    peak = values.max()
    tolerance = 4e-3 if scalar == 2 else 2e-4
    np.testing.assert_allclose(found[:, ::-1], values, rtol=tolerance, atol=tolerance * peak / 4)
    torch.testing.assert_close(pictures.light, store.light[:, 0], atol=1e-6, rtol=0)
    torch.testing.assert_close(pictures.view, store.view[:, 0], atol=1e-6, rtol=0)
    assert pictures.size_mm == pytest.approx(25)

    meta, data = pysmtb.read_ubo_btf_dfmf(str(path))
    channels = [u.astype(np.float32) @ sv.astype(np.float32).T for u, sv in zip(data.U, data.SxV, strict=True)]
    theirs = DECODERS[model](*map(torch.from_numpy, channels))
    np.testing.assert_allclose(theirs.reshape(found.shape).clamp_min(0).numpy(), found, rtol=1e-4, atol=1e-6)
    assert (meta.width, meta.height, meta.num_views, meta.num_lights) == (16, 16, 3, 12)
    np.testing.assert_allclose(np.array(meta.views_3d).reshape(3, 3), store.view[::12, 0], atol=1e-6)
    assert meta.cosine_in_data == 1 and meta.color_model == model


def test_the_largest_components_are_kept_and_the_same_seed_gives_the_same_file(tmp_path):
    store = shaded(specular=0.0)  # three numbers of each texel: three components hold it
    values = store.values(range(36)).float().numpy()[:, ::-1]
    errors = []
    for components in (1, 3):
        write_dfmf(tmp_path / "a.btf", store, components=components, colour_model=0, scalar_size=4)
        found, _ = read(tmp_path / "a.btf")
        errors.append(np.abs(found - values).max() / values.max())
    assert errors[0] > 0.1 and errors[1] < 0.06  # shadows aren't linear
    write_dfmf(tmp_path / "b.btf", store, components=3, colour_model=0, scalar_size=4)
    assert (tmp_path / "a.btf").read_bytes() == (tmp_path / "b.btf").read_bytes()


def test_only_grids_of_pictures_are_written(tmp_path):
    store = shaded()
    part = BtfStore.from_arrays(store.values(range(35)), store.light[:35], store.view[:35], kind="pictures")
    with pytest.raises(NeumatError, match="each of 12 lights once for each of 3 views"):
        write_dfmf(tmp_path / "a.btf", part)
    queries = BtfStore.from_arrays(store.values(range(2)), store.light[:2], store.view[:2], kind="queries")
    with pytest.raises(NeumatError, match="a store of pictures; found one of queries"):
        write_dfmf(tmp_path / "a.btf", queries)
    for options in ({"colour_model": 10}, {"scalar_size": 8}, {"components": 0}):
        with pytest.raises(NeumatError):
            write_dfmf(tmp_path / "a.btf", store, **options)
    bright = shaded(scale=1e5)
    with pytest.raises(NeumatError, match="half precision"):
        write_dfmf(tmp_path / "a.btf", bright, colour_model=0)
    assert not list(tmp_path.iterdir())


def test_a_store_of_a_btf_file_holds_the_cosine_whatever_the_file_holds(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    store = shaded()
    values = store.values(range(36)).float()
    write_dfmf(tmp_path / "with.btf", store, scalar_size=4)
    cosine = store.light[:, 0, 2][:, None, None, None]
    without = BtfStore.from_arrays(values / cosine, store.light, store.view, kind="pictures", cosine=False)
    write_dfmf(tmp_path / "without.btf", without, scalar_size=4)
    for name, contained in (("with", True), ("without", False)):
        read_back = read_measured(tmp_path / f"{name}.btf", tmp_path / "out.h5", cosine=contained)
        assert not [record for record in caplog.records if record.levelname == "WARNING"]
        assert f"(its header says that they {'do' if contained else 'do not'})" in caplog.text
        assert read_back.cosine and read_back.kind == "pictures" and not read_back.partial
        torch.testing.assert_close(read_back.values(range(36)).float(), values, rtol=4e-3, atol=1e-4)
        caplog.clear()


@pytest.mark.parametrize(("options", "warned"), [({"cosine": False}, "option cosine"), ({"rows": "up"}, "option rows")])
def test_pictures_that_contradict_the_options_are_warned_of(tmp_path, caplog, options, warned):
    write_dfmf(tmp_path / "a.btf", shaded(), scalar_size=4)
    read_measured(tmp_path / "a.btf", tmp_path / "out.h5", **options)
    (record,) = (record for record in caplog.records if record.levelname == "WARNING")
    assert warned in record.message and "\n" not in record.message


def test_options_scale_values_and_size(tmp_path):
    write_dfmf(tmp_path / "a.btf", shaded(), scalar_size=4)
    plain = read_measured(tmp_path / "a.btf", tmp_path / "plain.h5")
    other = read_measured(tmp_path / "a.btf", tmp_path / "other.h5", scale=2.0, size_mm=7.0)
    assert (plain.size_mm, other.size_mm) == (pytest.approx(25), 7)
    torch.testing.assert_close(other.values([3]).float(), 2 * plain.values([3]).float(), rtol=2e-3, atol=1e-6)
    for options in ({"scale": 0.0}, {"size_mm": -1}, {"gamma": math.nan}, {"rows": "left"}):
        with pytest.raises(NeumatError):
            read_measured(tmp_path / "a.btf", tmp_path / "bad.h5", **options)
    assert not (tmp_path / "bad.h5").exists()


NAN = np.full(3, np.nan, "<f4").tobytes()
HUGE = 0xFFFFFFFF
GOOD = body()[1]
OTHER_LIGHTS = LIGHTS + np.float32([[0], [0], [0.01], [0]])
BELOW = LIGHTS + np.float32([[0], [0], [2.0], [0]])


def matrix(components, rows=PICTURES, columns=TEXELS, data=b""):
    return body(matrices={1: struct.pack("<3I", components, rows, columns) + data})[1]


HOSTILE = {
    "empty": (b"", "found another kind of file"),
    "text": (b"just a text, no BTF at all", "found another kind of file"),
    "signature": (header(b"!PVF06FCR") + GOOD, "found PVF06FCR"),
    "longer signature": (header(b"!BDIF06R2!") + GOOD, "found BDIF06R2"),
    "version": (header(version=5) + GOOD, "expected meta data of version 1 to 4; found 5"),
    "meta size": (header(size=1) + GOOD, "expected meta data of 299 bytes; found 300"),
    "channels": (header(channels=4) + GOOD, "expected three channels; found 4"),
    "many channels": (header(channels=0)[:-1] + GOOD, "expected three channels; found 0"),
    "no texels": (header(side=(0, SIDE)) + GOOD, "found 0 x 4"),
    "many texels": (header(side=(HUGE, HUGE)) + GOOD, "found 4294967295 x 4294967295"),
    "oblong": (header(side=(2, 8)) + GOOD, "expected square pictures; found 2 x 8 texels"),
    "unequal lights": (header(lights=[LIGHTS, OTHER_LIGHTS, LIGHTS]) + GOOD, "found others for view 1 than for view 0"),
    "fewer lights": (header(lights=[LIGHTS, LIGHTS, LIGHTS[:3]]) + GOOD, "found others for view 2 than for view 0"),
    "no lights": (header(lights=[LIGHTS[:0]] * 3) + GOOD, "expected 1 to 10000 lights; found 0"),
    "below": (header(lights=[BELOW] * 3) + GOOD, "light directions with theta of 0 to pi / 2; found others"),
    "NaN in directions": (header(lights=[LIGHTS * np.float32("nan")] * 3) + GOOD, "lights of view 0; found NaN"),
    "Lab": (header() + body(2)[1], "a colour model of 0, 1, 9, 10, 11, 12; found 2 (Lab)"),
    "colour model": (header() + body(-7)[1], "found -7 (of no known name)"),
    "K = 0": (header() + matrix(0), "expected 1 to 9 components, the most that it has; found 0"),
    "short": (header() + GOOD[:-400], "its end after"),
    "K beyond the most": (header() + body(most=3)[1], "expected 1 to 3 components, the most that it has; found 4"),
    "huge factors": (header() + body(most=HUGE, matrices={1: struct.pack("<3I", HUGE, PICTURES, TEXELS)})[1],
                     "with 17179869180 bytes of singular values"),
    "wrong rows": (header() + matrix(2, HUGE), "factors for a matrix of 12 x 16; found 4294967295 x 16"),
    "scalar": (header() + GOOD[:56] + b"\3" + GOOD[57:], "scalars of 2, 4 or 8 bytes; found 3 bytes"),
    "NaN": (header() + matrix(3, data=NAN + bytes(3 * 28 * 4)), "finite numbers in its singular values"),
    "overflow": (header() + body(12, matrices={0: factors(PICTURES, TEXELS, scale=1e3)[2]})[1],
                 "factors whose products are finite; found NaN or infinite values"),
    "trailing bytes": (header() + GOOD + b"\0", "the end of the file after its last factors; found 1 bytes more"),
    "truncated": (header() + GOOD[:-1], "found its end after"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_a_broken_file_is_refused_in_one_line(tmp_path, name):
    data, message = HOSTILE[name]
    path, out = tmp_path / "bad.btf", tmp_path / "out.h5"
    path.write_bytes(data)
    with pytest.raises(NeumatError) as error:
        read_measured(path, out)
    assert message in str(error.value) and "\n" not in str(error.value) and str(path) in str(error.value)
    assert [file.name for file in tmp_path.iterdir()] == ["bad.btf"]


def test_what_is_no_file_is_refused(tmp_path):
    (tmp_path / "folder.btf").mkdir()
    for name, message in {
        "folder.btf": "no regular file",
        "none.btf": "no such file",
        "text.txt": "no such file",
    }.items():
        with pytest.raises(NeumatError, match=message):
            read_measured(tmp_path / name, tmp_path / "out.h5")
    (tmp_path / "text.txt").touch()
    with pytest.raises(NeumatError, match="found neither"):
        read_measured(tmp_path / "text.txt", tmp_path / "out.h5")


def test_a_disk_without_room_is_noticed_first(tmp_path, monkeypatch):
    (tmp_path / "a.btf").write_bytes(header() + GOOD)
    monkeypatch.setattr("shutil.disk_usage", lambda path: type("", (), {"free": 100})())
    with pytest.raises(NeumatError, match="room for"):
        read_measured(tmp_path / "a.btf", tmp_path / "out.h5")


FMF = header(b"!FMF12FCER") + struct.pack("<BI2I", 2, 1, 1, 2) + bytes(4) + struct.pack("<IB", 2, 4) + (
    factors(3 * PICTURES, TEXELS)[2]
)  # fmt: skip


@settings(max_examples=300)
@given(st.sampled_from([header() + body(11, dtype="<f2")[1], FMF]), st.data())
def test_mutated_files_are_read_or_refused(tmp_path_factory, whole, data):
    path = tmp_path_factory.getbasetemp() / "mutated.btf"
    mutated = bytearray(whole)
    positions = st.integers(0, len(whole) - 1)
    for at in data.draw(st.lists(positions | st.integers(0, 400), max_size=3)):
        mutated[at] = data.draw(st.sampled_from([0, 1, 0x7F, 0x80, 0xFF]) | st.integers(0, 255))
    if data.draw(st.booleans()):
        del mutated[data.draw(positions) :]
    path.write_bytes(mutated)
    try:
        found, _ = read(path)
    except NeumatError as error:
        assert "\n" not in str(error) and mutated != whole
    else:
        assert len(mutated) == len(whole) and np.isfinite(found).all() and (found >= 0).all()
