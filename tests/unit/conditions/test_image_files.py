import io
import os
import struct
import sys
import types
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from neumat.conditions import image_files
from neumat.conditions.image_files import read_square
from neumat.errors import NeumatError

SIZE = 32
RNG = np.random.default_rng(0)
SMOOTH = Image.fromarray(RNG.integers(0, 256, (5, 5, 3), dtype=np.uint8)).resize((96, 96), Image.Resampling.BICUBIC)
ORIENTATION = 0x0112


def encoded(image, format="JPEG", **options):
    buffer = io.BytesIO()
    image.save(buffer, format, **({"quality": 95} if format == "JPEG" else {}) | options)
    return buffer.getvalue()


def exif(*entries, order="<"):
    """Return an EXIF block of entries (tag, type, count, four bytes of value), none of which Pillow has checked."""
    body = b"".join(struct.pack(order + "HHI", tag, kind, count) + value for tag, kind, count, value in entries)
    head = {"<": b"II*\0", ">": b"MM\0*"}[order] + struct.pack(order + "I", 8)
    return b"Exif\0\0" + head + struct.pack(order + "H", len(entries)) + body + bytes(4)


def off(path, expected):
    return np.abs(read_square(path, SIZE).astype(int) - expected).mean()


@pytest.fixture
def reference(tmp_path):
    path = tmp_path / "reference.png"
    SMOOTH.save(path)
    return read_square(path, SIZE).astype(int)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("format", ["JPEG", "PNG", "TIFF", "WEBP"])
def test_every_orientation_of_every_format_is_shown_upright(tmp_path, reference, orientation, format):
    undo = {v: k for k, v in ((2, 2), (3, 3), (4, 4), (5, 5), (6, 8), (7, 7), (8, 6))}
    turn = image_files.ORIENTATIONS.get(undo.get(orientation))
    stored = SMOOTH.transpose(turn) if turn is not None else SMOOTH
    tags = Image.Exif()
    tags[ORIENTATION] = orientation
    path = tmp_path / "turned"
    path.write_bytes(encoded(stored, format, exif=tags))
    assert off(path, reference) < 3


BAD_TAGS = [
    (0x011A, 10, 1, struct.pack("<I", 9999)),  # a fraction beyond the block's end
    (0x011A, 2, 4, b"1/72"),  # a text where a fraction belongs
    (0x0103, 9, 1, struct.pack("<i", -5)),  # a negative number where none can be
    (0x8769, 4, 1, struct.pack("<I", 0xFFFFFFFF)),  # a directory nowhere
    (0x8769, 2, 4, b"text"),
    (0x0131, 77, 9, b"kind"),  # a type that does not exist
    (0xA005, 4, 1, struct.pack("<I", 8)),  # a directory that holds itself
]


@pytest.mark.parametrize("bad", BAD_TAGS)
@pytest.mark.parametrize("format", ["JPEG", "PNG", "WEBP"])
def test_tags_that_cannot_be_read_or_written_fail_no_picture(tmp_path, reference, bad, format):
    block = exif((ORIENTATION, 3, 1, struct.pack("<HH", 6, 0)), bad)
    path = tmp_path / "tagged"
    path.write_bytes(encoded(SMOOTH.transpose(Image.Transpose.ROTATE_90), format, exif=block))
    assert off(path, reference) < 3


@pytest.mark.parametrize("bad", [tag for tag in BAD_TAGS if tag[0] != 0x0103])  # which a TIFF file needs
def test_tags_that_cannot_be_read_or_written_fail_no_tiff(tmp_path, bad):
    grey = SMOOTH.convert("L").crop((0, 0, 96, 64))
    stored = grey.transpose(Image.Transpose.ROTATE_90)
    short, long = 3, 4
    values = {0x0100: stored.width, 0x0101: stored.height, 0x0102: 8, 0x0103: 1, 0x0106: 1, ORIENTATION: 6, 0x0115: 1,
              0x0116: stored.height}  # fmt: skip
    tags = [(tag, short, 1, struct.pack("<HH", value, 0)) for tag, value in values.items()]
    start = 8 + 2 + 12 * (len(tags) + 3) + 4
    tags += [(0x0111, long, 1, struct.pack("<I", start)), (0x0117, long, 1, struct.pack("<I", 96 * 64)), bad]
    path = tmp_path / "tagged.tif"
    path.write_bytes(exif(*sorted(tags))[6:] + stored.tobytes())
    grey.save(tmp_path / "grey.png")
    assert off(path, read_square(tmp_path / "grey.png", SIZE).astype(int)) < 1


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 400), st.integers(0, 255)), max_size=8), st.sampled_from("<>"))
def test_no_change_to_the_tags_fails_a_picture(tmp_path_factory, changes, order):
    value = struct.pack(order + "HH", 6, 0)
    entries = [(tag, 5, 1, struct.pack(order + "I", 40)) for tag in (0x011A, 0x829A, 0x8769, 0x8825, 0xA005)]
    block = bytearray(exif((ORIENTATION, 3, 1, value), *entries, order=order))
    for at, byte in changes:
        block[6 + at % (len(block) - 6)] = byte
    path = tmp_path_factory.mktemp("tags") / "a.jpg"
    path.write_bytes(encoded(SMOOTH, exif=bytes(block)))
    assert read_square(path, SIZE).shape == (SIZE, SIZE, 3)


FORMATS = {format: encoded(SMOOTH, format) for format in ("JPEG", "PNG", "TIFF", "WEBP", "GIF", "BMP")}


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(sorted(FORMATS)), st.data())
def test_a_damaged_file_is_a_picture_or_one_line(tmp_path_factory, format, data):
    content = bytearray(FORMATS[format])
    for at, byte in data.draw(st.lists(st.tuples(st.integers(0, 200), st.integers(0, 255)), max_size=4)):
        content[at % len(content)] = byte
    content = content[: data.draw(st.integers(0, len(content)))]
    path = tmp_path_factory.mktemp("damaged") / "a.png"
    path.write_bytes(content)
    try:
        assert read_square(path, SIZE).shape == (SIZE, SIZE, 3)
    except NeumatError as error:
        assert "\n" not in str(error) and str(path) in str(error)


def test_a_huge_jpeg_is_read(tmp_path):
    path = tmp_path / "huge.jpg"
    grey = SMOOTH.convert("L")
    grey.resize((14400, 12500), Image.Resampling.NEAREST).save(path, quality=50)  # beyond Pillow's own limit
    middle = (96 * 950 / 14400, 0, 96 * 13450 / 14400, 96)
    expected = grey.convert("RGB").resize((SIZE, SIZE), Image.Resampling.BOX, middle)
    assert off(path, np.asarray(expected, int)) < 4


def test_a_large_picture_is_converted_strip_by_strip(tmp_path, monkeypatch):
    large = SMOOTH.resize((1000, 900), Image.Resampling.NEAREST)
    expected = np.asarray(large.resize((SIZE, SIZE), Image.Resampling.BOX, (50, 0, 950, 900)), int)
    strips = []
    convert = image_files.to_srgb
    monkeypatch.setattr(image_files, "to_srgb", lambda image: strips.append(image.size) or convert(image))
    monkeypatch.setattr(image_files, "STRIP", 1 << 16)
    for format in ("PNG", "GIF", "BMP"):
        (tmp_path / "large").write_bytes(encoded(large, format))
        strips.clear()
        assert off(tmp_path / "large", expected) < (10 if format == "GIF" else 1)
        assert len(strips) > 10 and max(width * height for width, height in strips) <= 1 << 16


def with_size(png, width, height, depth=8, colour=2):
    """Return a PNG file that tells another size than it has."""
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return png[:16] + header + struct.pack(">I", zlib.crc32(b"IHDR" + header)) + png[33:]


@pytest.mark.parametrize(("size", "words"), [
    ((30_000, 20_000, 8, 2), "at most 300 megapixels"),
    ((16_000, 16_000, 16, 0), "at most 1.5 GB; found 6.1 GB"),
])  # fmt: skip
def test_what_needs_too_much_memory_is_refused_before_it_is_read(tmp_path, size, words):
    path = tmp_path / "bomb.png"
    path.write_bytes(with_size(encoded(SMOOTH, "PNG"), *size))
    with pytest.raises(NeumatError, match=words):
        read_square(path, SIZE)


def test_the_limits_of_pillow_are_as_they_were(tmp_path):
    before = Image.MAX_IMAGE_PIXELS
    for content in (encoded(SMOOTH), b"broken"):
        path = tmp_path / "a.jpg"
        path.write_bytes(content)
        try:
            read_square(path, SIZE)
        except NeumatError:
            pass
        assert Image.MAX_IMAGE_PIXELS == before


def test_a_message_names_the_formats_and_the_cause(tmp_path, monkeypatch):
    monkeypatch.setattr(image_files, "_register_heif", lambda: None)
    monkeypatch.delitem(Image.OPEN, "HEIF", raising=False)
    heic = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic" + bytes(64)
    for name, content, cause in (
        ("a.heic", heic, "a HEIC file"),
        ("a.txt", b"words", "another kind of file"),
        ("a.png", b"", "an empty file"),
        ("cut.png", encoded(SMOOTH, "PNG")[:2000], "truncated"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(
            NeumatError, match=r"JPEG.*PNG.*TIFF.*HEIC with the package pillow-heif.*found " + ".*" + cause
        ):
            read_square(tmp_path / name, SIZE)
    for name, cause in (("", "a folder"), ("none.png", "no such file")):
        with pytest.raises(NeumatError, match=cause):
            read_square(tmp_path / name, SIZE)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read_says_so(tmp_path):
    path = tmp_path / "a.png"
    SMOOTH.save(path)
    path.chmod(0)
    with pytest.raises(NeumatError, match="permission"):
        read_square(path, SIZE)


def test_another_reader_is_used_where_it_is_installed(monkeypatch, tmp_path):
    called = []
    package = types.SimpleNamespace(register_heif_opener=lambda: called.append(True))
    monkeypatch.setitem(sys.modules, "pillow_heif", package)
    image_files._register_heif.cache_clear()
    SMOOTH.save(tmp_path / "a.png")
    read_square(tmp_path / "a.png", SIZE)
    assert called
    image_files._register_heif.cache_clear()


def test_heic_is_read_where_its_reader_is_installed(tmp_path, reference):
    pillow_heif = pytest.importorskip("pillow_heif")
    pillow_heif.register_heif_opener()
    SMOOTH.save(tmp_path / "a.heic", quality=95)
    assert off(tmp_path / "a.heic", reference) < 4
