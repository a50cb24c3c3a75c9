"""Sets of pictures named as UBO2003's: read from folders and zips, complete or refused."""

import io
import math
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from neumat.btf.directions import ubo2003_directions
from neumat.btf.measured import read_measured
from neumat.btf.rgbe import decode_rgbe
from neumat.btf.ubo2003 import ANGLES, read_ubo2003
from neumat.errors import NeumatError

WALLPAPER = Path(__file__).parents[4] / "shared/data/btf/ubo2003-wallpaper"
SIDE = 8


def name(light, view, suffix="jpg"):
    return "{:05} tl{:03} pl{:03} tv{:03} pv{:03}.{}".format(81 * light + view, *ANGLES[light], *ANGLES[view], suffix)


def encoded(picture, **options):
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, **({"format": "JPEG", "quality": 95, "subsampling": 0} | options))
    return stream.getvalue()


def picture(light, view):
    """Return a picture (side, side, 3), uint8: brighter in its upper half, darker with the light's theta."""
    grey = np.full((SIDE, SIDE, 3), 200 * math.cos(math.radians(ANGLES[light][0])) ** (1 / 2.2), np.uint8)
    grey[SIDE // 2 :] //= 2
    grey[..., 2] = view
    return grey


FILES = {name(light, view): encoded(picture(light, view)) for view in (0, 8) for light in range(81)}


def rgbe(width, height, lines=b"FORMAT=32-bit_rle_rgbe\n", data=None, seed=0):
    """Return random pixels (height, width, 4), uint8, and a file of them without compression."""
    pixels = np.random.default_rng(seed).integers(120, 140, (height, width, 4), np.uint8)
    start = b"#?RADIANCE\n" + lines + b"\n-Y %d +X %d\n" % (height, width)
    return pixels, start + (pixels.tobytes() if data is None else data)


@pytest.fixture
def folder(tmp_path):
    def make(files, below=True):
        root = tmp_path / "set"
        for key, data in files.items():
            angles = key.split(".")[0].split()[-2:]
            path = root / "_".join(angles) / key if below and len(angles) == 2 else root / key
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        return root

    return make


@pytest.fixture
def zipped(tmp_path):
    def make(files, compression=zipfile.ZIP_STORED):
        path = tmp_path / "set.zip"
        with zipfile.ZipFile(path, "w", compression) as archive:
            for key, data in files.items():
                archive.writestr(key, data)
        return path

    return make


def test_a_folder_and_a_zip_are_read_alike(folder, zipped, tmp_path):
    extra = {"readme.txt": b"text", ".DS_Store": b"", "._00000 tl000 pl000 tv000 pv000.jpg": b"a Mac's"}
    stores = [
        read_measured(path, tmp_path / f"{k}.h5")
        for k, path in enumerate((
            folder(FILES | extra),
            zipped({f"SET/tv/{key}": data for key, data in FILES.items()} | {"__MACOSX/" + name(0, 3): b""}),
        ))
    ]  # fmt: skip
    for store in stores:
        assert (store.sweeps, store.height, store.width, store.pairs) == (162, SIDE, SIDE, 1)
        assert store.partial and store.cosine and store.kind == "pictures"
        assert torch.equal(store.values(range(162)), stores[0].values(range(162)))
    directions = ubo2003_directions()
    torch.testing.assert_close(store.light[:, 0], directions.repeat(2, 1))
    torch.testing.assert_close(store.view[:, 0], directions[[0, 8]].repeat_interleave(81, 0))
    expected = (np.array([picture(light, view) for view in (0, 8) for light in range(81)]) / 255) ** 2.2 / math.pi
    # The first row of a picture is its top, +y: the last of the store.
    np.testing.assert_allclose(store.values(range(162)).float().numpy()[:, ::-1], expected, atol=0.01)


def test_angles_in_names_are_those_of_the_directions():
    theta, phi = np.radians(ANGLES).T
    expected = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    np.testing.assert_allclose(ubo2003_directions(), expected, atol=1e-6)


def test_a_set_with_all_views_is_not_partial(zipped):
    every = {name(light, view): FILES[LAST] for view in range(81) for light in range(81)}
    pictures = read_ubo2003(zipped(every))
    assert len(pictures.light) == 6561 and not pictures.partial


def test_gamma_and_cosine_are_options(folder, tmp_path):
    root = folder(FILES)
    linear = read_measured(root, tmp_path / "linear.h5", gamma=1.0, cosine=False, scale=1.0)
    top = linear.values(range(81)).float()[:, -1, 0, 0]
    cosine = ubo2003_directions()[:, 2]
    torch.testing.assert_close(top, 200 / 255 * cosine ** (1 / 2.2) * cosine, atol=0.01, rtol=0)


@pytest.mark.skipif(not WALLPAPER.is_dir(), reason="no measured BTF in ../shared/data/btf")
def test_the_wallpaper_is_one_view_whose_conventions_it_shows_itself(tmp_path, caplog):
    store = read_measured(WALLPAPER, tmp_path / "a.h5")
    assert (store.sweeps, store.height, store.width, store.partial) == (81, 256, 256, True)
    assert not [record for record in caplog.records if record.levelname == "WARNING"]
    first = np.asarray(Image.open(WALLPAPER / name(80, 0)))
    np.testing.assert_allclose(
        store.values([80]).float().numpy()[0, ::-1], (first / 255) ** 2.2 / math.pi, rtol=1e-3, atol=1e-6
    )
    read_measured(WALLPAPER, tmp_path / "b.h5", cosine=False, rows="up")
    warned = [record.message for record in caplog.records if record.levelname == "WARNING"]
    assert ["option cosine" in warned[0], "option rows" in warned[1], len(warned)] == [True, True, 2]


def test_hdr_pictures_are_read_as_mitsuba_writes_them(tmp_path):
    mitsuba = pytest.importorskip("mitsuba")
    from neumat.render.variant import variant

    variant()
    values = np.random.default_rng(0).random((9, 40, 3)).astype(np.float32) ** 6 * 100
    values[3:5, :30] = 0.25  # runs
    mitsuba.Bitmap(values).write(str(tmp_path / "a.hdr"))
    found = decode_rgbe((tmp_path / "a.hdr").read_bytes(), 100)
    assert (np.abs(found - values) <= values.max(-1, keepdims=True) / 127).all()
    np.testing.assert_allclose(found, np.array(mitsuba.Bitmap(str(tmp_path / "a.hdr"))), rtol=1e-6)


def test_hdr_pictures_without_compression_and_with_exposure():
    lines = b"# a comment\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\nEXPOSURE= 4.0\n"
    pixels, data = rgbe(3, 5, lines)
    expected = pixels[..., :3] * 2.0 ** (pixels[..., 3:].astype(float) - 136) / 8
    np.testing.assert_allclose(decode_rgbe(data, 10), expected, rtol=1e-6)


def test_a_set_of_hdr_pictures_keeps_its_values(folder, tmp_path):
    pixels, data = rgbe(SIDE, SIDE)
    store = read_measured(folder({name(light, 3, "hdr"): data for light in range(81)}), tmp_path / "a.h5")
    expected = pixels[..., :3] * 2.0 ** (pixels[..., 3:].astype(float) - 136)
    np.testing.assert_allclose(store.values([5])[0].flip(0), expected, rtol=1e-3)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "header"),
        (rgbe(4, 4, b"FORMAT=32-bit_rle_xyze\n")[1], "header"),
        (rgbe(4, 4)[1].replace(b"-Y", b"+Y"), "header"),
        (rgbe(4, 4)[1].replace(b"-Y 4", b"-Y 99999"), "4 x 99999 pixels"),
        (rgbe(4, 4)[1].replace(b"-Y 4", b"-Y 0"), "4 x 0 pixels"),
        (rgbe(4, 4)[1][:-1], "an end before the last pixel"),
        (rgbe(4, 4)[1] + b"\0", "more data than pixels"),
        (rgbe(9, 1, data=bytes((2, 2, 0, 9, 0, 7)))[1], "a damaged run"),
        (rgbe(9, 1, data=bytes((2, 2, 0, 9, 255, 7)))[1], "a damaged run"),
        (rgbe(9, 1, data=bytes((2, 2, 0, 9, 9, 7, 7)))[1], "a damaged run"),
        (rgbe(9, 1, data=bytes((2, 2, 0, 9, 137, 7)))[1], "an end before the last pixel"),
        (rgbe(9, 2, data=bytes((2, 2, 0, 9)) + bytes((137, 7)) * 5)[1], "a row without its start"),
        (rgbe(4, 4, b"EXPOSURE=0\nFORMAT=32-bit_rle_rgbe\n")[1], "an exposure of 0"),
        (rgbe(4, 4, b"EXPOSURE=1e\nFORMAT=32-bit_rle_rgbe\n")[1], "could not convert"),
    ],
)
def test_a_broken_hdr_picture_is_refused(data, message):
    with pytest.raises(ValueError, match=message):
        decode_rgbe(data, 100)


CMYK = io.BytesIO()
Image.new("CMYK", (SIDE, SIDE)).save(CMYK, "JPEG")
WIDE = encoded(np.zeros((1, 5000, 3), np.uint8))
PNG = encoded(picture(0, 0), format="PNG", quality=None, subsampling=None)
HDR = {name(light, 0, "hdr"): rgbe(SIDE, SIDE)[1] for light in range(81)}
TINY = {name(light, 0, "hdr"): rgbe(SIDE, SIDE, b"EXPOSURE=1e-40\nFORMAT=32-bit_rle_rgbe\n")[1] for light in range(81)}
LAST = name(80, 8)

BROKEN = {
    "missing": ({key: data for key, data in FILES.items() if key != name(7, 8)},
                "expected all 81 lights of every view; found no 00575 tl030 pl000 tv030 pv030"),
    "none": ({"readme.txt": b""}, "found none"),
    "number": ({"00001 tl000 pl000 tv000 pv000.jpg": b""}, "of UBO2003's directions; found"),
    "angle": ({"00001 tl000 pl000 tv015 pv010.jpg": b""}, "00001 tl000 pl000 tv015 pv010.jpg'"),
    "large number": ({"99999 tl000 pl000 tv000 pv000.jpg": b""}, "99999 tl000 pl000 tv000 pv000.jpg'"),
    "name": (FILES | {"holiday.jpg": b""}, "found 'holiday.jpg'"),
    "other format": (FILES | {"00008 tl000 pl000 tv030 pv030.exr": b""}, "00008 tl000 pl000 tv030 pv030.exr'"),
    "two formats": (FILES | HDR, "expected each picture once; found"),
    "mixed": (FILES | {name(light, 3, "hdr"): rgbe(SIDE, SIDE)[1] for light in range(81)}, "found .hdr and .jpg"),
    "empty": (FILES | {LAST: b""}, "found another kind of file, or a damaged one"),
    "truncated": (FILES | {LAST: FILES[LAST][:-40]}, "a JPEG picture of 8-bit RGB of at most 4096 pixels a side"),
    "grey": (FILES | {LAST: encoded(picture(0, 0)[..., 0])}, "found one of colour mode L"),
    "CMYK": (FILES | {LAST: CMYK.getvalue()}, "found one of colour mode CMYK"),
    "PNG": (FILES | {LAST: PNG}, "found another kind of file, or a damaged one"),
    "16 bits": (FILES | {LAST: encoded(np.zeros((8, 8), np.uint16), format="PNG", quality=None, subsampling=None)},
                "found another kind of file, or a damaged one"),
    "other size": (FILES | {LAST: encoded(np.zeros((16, 16, 3), np.uint8))},
                   "8 x 8 pixels, as the first; found 16 x 16"),
    "oblong": (FILES | {name(0, 0): encoded(np.zeros((16, 8, 3), np.uint8))}, "a square picture; found 8 x 16"),
    "huge": (FILES | {LAST: WIDE}, "found 5000 x 1 pixels"),
    "infinite": (TINY, "expected finite values; found infinite ones"),
}  # fmt: skip


@pytest.mark.parametrize("key", BROKEN)
def test_a_broken_set_is_refused_in_one_line(zipped, folder, tmp_path, key):
    files, message = BROKEN[key]
    for path in (zipped(files), folder(files)):
        before = sorted(tmp_path.iterdir())
        with pytest.raises(NeumatError) as error:
            read_measured(path, tmp_path / "out.h5")
        assert message in str(error.value) and "\n" not in str(error.value) and str(path) in str(error.value)
        assert "0x" not in str(error.value)  # addresses of objects
        assert sorted(tmp_path.iterdir()) == before


def test_a_picture_in_the_folder_of_another_view_is_refused(zipped):
    with pytest.raises(NeumatError, match="every picture in the folder of its view"):
        read_ubo2003(zipped({f"tv015_pv000/{name(0, 0)}": b""}))


def test_what_is_no_regular_file_is_refused(folder, tmp_path):
    root = folder(FILES)
    pipe = root / "tv030_pv030" / LAST
    pipe.unlink()
    os.mkfifo(pipe)  # whoever opens it waits
    with pytest.raises(NeumatError, match="expected a picture; found no regular file"):
        read_measured(root, tmp_path / "out.h5")
    os.mkfifo(tmp_path / "pipe.zip")
    with pytest.raises(NeumatError, match="no regular file"):
        read_measured(tmp_path / "pipe.zip", tmp_path / "out.h5")


@pytest.mark.parametrize("bad", ["../", "/", "tv/../../", "..\\"])
def test_names_that_leave_the_zip_are_refused(zipped, bad):
    with pytest.raises(NeumatError, match="names that stay inside the zip"):
        read_ubo2003(zipped(FILES | {bad + name(0, 3): FILES[name(0, 0)]}))


def test_a_zip_bomb_is_not_unpacked(zipped, monkeypatch):
    bomb = zipped(FILES | {name(0, 0): bytes(10_000_000)}, zipfile.ZIP_DEFLATED)
    monkeypatch.setattr(zipfile.ZipFile, "read", None)
    with pytest.raises(NeumatError, match="100 times their compressed size; found 10000000 from"):
        read_ubo2003(bomb)


def test_a_size_that_a_zip_cannot_hold_is_refused_before_it_is_allocated(zipped):
    path = zipped(FILES)
    data = bytearray(path.read_bytes())
    at = data.find(b"PK\x01\x02")
    data[at + 20 : at + 24] = b"\xff\xff\xff\x7f"  # the packed size of the first file
    path.write_bytes(data)
    with pytest.raises(NeumatError, match=f"found {len(FILES[name(0, 0)])} from 2147483647"):
        read_ubo2003(path)


def test_too_many_files_and_names_given_twice_are_refused(zipped, monkeypatch):
    path = zipped(FILES)
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate name"):
        archive.writestr(LAST, b"")
    with pytest.raises(NeumatError, match="each name once"):
        read_ubo2003(path)
    monkeypatch.setattr("neumat.btf.ubo2003.MOST_FILES", 100)
    with pytest.raises(NeumatError, match="at most 100 files; found 163"):
        read_ubo2003(path)


def test_a_large_file_is_not_read(folder, monkeypatch):
    root = folder(FILES)
    monkeypatch.setattr("neumat.btf.ubo2003.LARGEST_FILE", 100)
    with pytest.raises(NeumatError, match="at most 100 bytes"):
        read_ubo2003(root)


def test_an_encrypted_or_foreign_zip_is_refused(zipped, tmp_path):
    path = zipped(FILES)
    data = bytearray(path.read_bytes())
    for mark, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):  # the flag that a file is encrypted
        at = data.find(mark)
        data[at + offset] |= 1
    path.write_bytes(data)
    with pytest.raises(NeumatError, match="damaged or foreign"):
        read_ubo2003(path)
    path.write_bytes(b"no zip")
    with pytest.raises(NeumatError, match="damaged or foreign"):
        read_ubo2003(path)
    with pytest.raises(NeumatError, match="no such file"):
        read_ubo2003(tmp_path / "none.zip")


def whole_zip(files):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for key, data in files.items():
            archive.writestr(key, data)
    return stream.getvalue()


WHOLE = whole_zip({key: data for key, data in FILES.items() if "tv000" in key})


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_mutated_zips_are_read_or_refused(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "mutated.zip"
    mutated = bytearray(WHOLE)
    for at in data.draw(st.lists(st.integers(0, len(WHOLE) - 1), max_size=4)):
        mutated[at] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        del mutated[data.draw(st.integers(0, len(WHOLE) - 1)) :]
    path.write_bytes(mutated)
    check(lambda: read_ubo2003(path).read(slice(None)))


RUNS = rgbe(SIDE + 1, 1, data=bytes((2, 2, 0, SIDE + 1)) + bytes((128 + SIDE + 1, 7)) * 4)[1]


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(whole=st.sampled_from([FILES[LAST], rgbe(SIDE, SIDE)[1], RUNS]), data=st.data())
def test_mutated_pictures_are_read_or_refused(folder, whole, data):
    mutated = bytearray(whole)
    for at in data.draw(st.lists(st.integers(0, len(whole) - 1), max_size=4)):
        mutated[at] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        del mutated[data.draw(st.integers(0, len(whole) - 1)) :]
    suffix = "jpg" if whole == FILES[LAST] else "hdr"
    root = folder(
        {f"{suffix}/{name(light, 0, suffix)}": b"" if light else bytes(mutated) for light in range(81)}, False
    )
    check(lambda: read_ubo2003(root / suffix) and [])  # which decodes the first picture


def check(read):
    """Assert that pictures are finite, or refused in one line."""
    try:
        pictures = read()
    except NeumatError as error:
        assert "\n" not in str(error)
    else:
        assert all(np.isfinite(np.asarray(picture)).all() for picture in pictures)
