import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image, ImageCms

from neumat.conditions.colour_spaces import ADOBE_RGB, SRGB_PRIMARIES
from neumat.conditions.image_files import read_square

SIZE = 64
X, Y = np.meshgrid(np.linspace(0.1, 0.9, SIZE), np.linspace(0.1, 0.9, SIZE))
COLOURS = np.stack([X, Y, 0.5 * (1 - X) + 0.3 * Y], 2)  # linear, as sRGB's primaries
P3_PRIMARIES = (0.3127, 0.3290, 0.680, 0.320, 0.265, 0.690, 0.150, 0.060)
WHITES = {"D65": (0.3127, 0.3290), "D50": (0.3457, 0.3585)}
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
# The published matrix from linear sRGB to XYZ, and the one from XYZ to linear Display P3 (CSS Color 4).
SRGB_TO_XYZ = np.array([[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923],
                        [0.0193308, 0.1191948, 0.9505322]])  # fmt: skip
XYZ_TO_P3 = np.array([[2.4934969, -0.9313836, -0.4027108], [-0.8294890, 1.7626641, 0.0236247],
                      [0.0358458, -0.0761724, 0.9568845]])  # fmt: skip
XYZ_TO_ADOBE = np.array([[2.0415879, -0.5650070, -0.3447314], [-0.9692436, 1.8759675, 0.0415551],
                         [0.0134443, -0.1183624, 1.0151750]])  # fmt: skip


def srgb(linear):
    return np.where(linear > 0.0031308, 1.055 * linear.clip(1e-9) ** (1 / 2.4) - 0.055, 12.92 * linear)


def eight_bits(values):
    return Image.fromarray((values.clip(0, 1) * 255).round().astype(np.uint8))


EXPECTED = np.asarray(eight_bits(srgb(COLOURS)), int)


def chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(image, *chunks):
    """Return a PNG file with these chunks before the pixels."""
    buffer = io.BytesIO()
    image.save(buffer, "PNG")
    content = buffer.getvalue()
    return content[:33] + b"".join(chunks) + content[33:]


def gama(gamma):
    return chunk(b"gAMA", struct.pack(">I", round(gamma * 100_000)))


def chrm(primaries):
    return chunk(b"cHRM", struct.pack(">8I", *(round(value * 100_000) for value in primaries)))


def off(tmp_path, content, expected=EXPECTED):
    """Return the mean difference of an image file's content from what it should be read as."""
    path = tmp_path / "a.png"
    path.write_bytes(content)
    return np.abs(read_square(path, SIZE) - expected).mean()


def profile(to_space, gamma):
    """Return an ICC profile, version 2, of a space given by its matrix from XYZ (None: grey) and its exponent."""
    d50, d65 = ((np.array([x / y, 1, (1 - x - y) / y])) for x, y in (WHITES["D50"], WHITES["D65"]))
    adapt = np.linalg.inv(BRADFORD) @ np.diag(BRADFORD @ d50 / (BRADFORD @ d65)) @ BRADFORD

    def xyz(values):
        return b"XYZ \0\0\0\0" + struct.pack(">3i", *(round(v * 65536) for v in values))

    curve = b"curv\0\0\0\0" + struct.pack(">IH", 1, round(gamma * 256)) + b"\0\0"
    tags = {b"wtpt": xyz(d50), b"desc": b"desc\0\0\0\0" + struct.pack(">I", 2) + b"a\0" + bytes(79),
            b"cprt": b"text\0\0\0\0a\0\0\0"}  # fmt: skip
    if to_space is None:
        tags[b"kTRC"] = curve
    else:
        columns = (adapt @ np.linalg.inv(to_space)).T
        tags |= {name: xyz(column) for name, column in zip((b"rXYZ", b"gXYZ", b"bXYZ"), columns, strict=True)}
        tags |= {b"rTRC": curve, b"gTRC": curve, b"bTRC": curve}
    table, data, start = b"", b"", 132 + 12 * len(tags)
    for name, body in tags.items():
        body += bytes(-len(body) % 4)
        table, data = table + name + struct.pack(">II", start + len(data), len(body)), data + body
    body = struct.pack(">I", len(tags)) + table + data
    head = struct.pack(">I", 128 + len(body)) + b"\0\0\0\0\2\x10\0\0mntr" + (b"GRAY" if to_space is None else b"RGB ")
    head += b"XYZ " + bytes(12) + b"acsp" + bytes(28) + struct.pack(">3i", *(round(v * 65536) for v in d50))
    return head.ljust(128, b"\0") + body


def in_space(to_space, gamma):
    return eight_bits((COLOURS @ (to_space @ SRGB_TO_XYZ).T).clip(0) ** (1 / gamma))


def saved(image, format="PNG", **options):
    buffer = io.BytesIO()
    image.save(buffer, format, **options)
    return buffer.getvalue()


@pytest.mark.parametrize("matrix", [XYZ_TO_P3, XYZ_TO_ADOBE, np.linalg.inv(SRGB_TO_XYZ)])
@pytest.mark.parametrize("gamma", [1.8, 2.2])
@pytest.mark.parametrize("format", ["PNG", "TIFF", "WEBP", "JPEG"])
def test_pictures_with_a_profile(tmp_path, matrix, gamma, format):
    quality = {"lossless": True} if format == "WEBP" else {"quality": 98, "subsampling": 0} if format == "JPEG" else {}
    content = saved(in_space(matrix, gamma), format, icc_profile=profile(matrix, gamma), **quality)
    assert off(tmp_path, content) < 1.5


def test_a_profile_of_grey_and_what_is_transparent(tmp_path):
    grey = COLOURS[..., 0]
    expected = np.asarray(eight_bits(srgb(grey)).convert("RGB"), int)
    stored = eight_bits(grey ** (1 / 1.8))
    assert off(tmp_path, saved(stored, icc_profile=profile(None, 1.8)), expected) < 1.5
    opaque = Image.merge("LA", (stored, Image.new("L", stored.size, 255)))
    assert off(tmp_path, saved(opaque, icc_profile=profile(None, 1.8)), expected) < 1.5
    halves = Image.fromarray(np.where(X > 0.5, 255, 0).astype(np.uint8))
    clear = Image.merge("RGBA", (*in_space(XYZ_TO_P3, 1.8).split(), halves))
    shown = np.where(X[..., None] > 0.5, EXPECTED, 119)  # mid grey in sRGB, not in the picture's space
    assert off(tmp_path, saved(clear, icc_profile=profile(XYZ_TO_P3, 1.8)), shown) < 1.5


def test_a_profile_of_inks(tmp_path):
    """LittleCMS makes no such profile; a JPEG in CMYK with one that is not of inks is converted without it."""
    picture = eight_bits(srgb(COLOURS)).convert("CMYK")
    plain = np.asarray(picture.convert("RGB"), int)
    content = saved(picture, "TIFF", icc_profile=profile(XYZ_TO_P3, 1.8))
    assert off(tmp_path, content, plain) < 1


@pytest.mark.parametrize("broken", [
    b"", b"words", profile(XYZ_TO_P3, 1.8)[:200], bytes(500), profile(None, 1.8), profile(XYZ_TO_P3, 1.8)[:128],
])  # fmt: skip
@pytest.mark.parametrize("format", ["PNG", "JPEG", "TIFF"])
def test_a_broken_or_foreign_profile_fails_no_picture(tmp_path, broken, format):
    quality = {"quality": 98, "subsampling": 0} if format == "JPEG" else {}
    assert off(tmp_path, saved(eight_bits(srgb(COLOURS)), format, icc_profile=broken, **quality)) < 1.5


def test_a_picture_without_a_readable_space_is_told(tmp_path, caplog):
    assert off(tmp_path, saved(eight_bits(srgb(COLOURS)), icc_profile=b"words")) == 0
    assert len(caplog.messages) == 1 and "taken for sRGB" in caplog.text
    caplog.clear()  # a large picture is converted in several strips
    large = eight_bits(srgb(COLOURS)).resize((5000, 5000), Image.Resampling.NEAREST)
    assert off(tmp_path, saved(large, icc_profile=b"words")) < 2
    assert len(caplog.messages) == 1


def test_a_profile_larger_than_pillows_limit(tmp_path):
    large = profile(XYZ_TO_P3, 1.8) + np.random.default_rng(0).bytes(3 << 20)
    assert off(tmp_path, saved(in_space(XYZ_TO_P3, 1.8), icc_profile=large)) < 1.5


@pytest.mark.parametrize("gamma", [1.0, 1 / 1.8, 1 / 2.2])
def test_the_chunks_gama_and_chrm(tmp_path, gamma):
    stored = eight_bits(COLOURS**gamma)
    assert off(tmp_path, png(stored, gama(gamma))) < 2
    assert off(tmp_path, png(stored, chrm(SRGB_PRIMARIES), gama(gamma))) < 2
    assert off(tmp_path, png(in_space(XYZ_TO_P3, 1 / gamma), gama(gamma), chrm(P3_PRIMARIES))) < 2
    grey = eight_bits(COLOURS[..., 0] ** gamma)
    expected = np.asarray(eight_bits(srgb(COLOURS[..., 0])).convert("RGB"), int)
    assert off(tmp_path, png(grey, gama(gamma)), expected) < 2


def test_chrm_alone_has_srgbs_curve(tmp_path):
    linear = (COLOURS @ (XYZ_TO_P3 @ SRGB_TO_XYZ).T).clip(0)
    assert off(tmp_path, png(eight_bits(srgb(linear)), chrm(P3_PRIMARIES))) < 1


def test_another_white_point_is_adapted_to(tmp_path):
    white = Image.new("RGB", (SIZE, SIZE), (200, 200, 200))
    content = png(white, gama(1 / 2.2), chrm((*WHITES["D50"], *P3_PRIMARIES[2:])))
    path = tmp_path / "a.png"
    path.write_bytes(content)
    assert np.ptp(read_square(path, SIZE), axis=2).max() <= 1


def test_the_chunk_srgb_and_a_profile_outrank_gama(tmp_path):
    plain = eight_bits(srgb(COLOURS))
    assert off(tmp_path, png(plain, chunk(b"sRGB", b"\0"), gama(1.0))) == 0
    with_profile = chunk(b"iCCP", b"a\0\0" + zlib.compress(profile(XYZ_TO_P3, 1.8)))
    assert off(tmp_path, png(in_space(XYZ_TO_P3, 1.8), with_profile, gama(1.0))) < 1.5


@pytest.mark.parametrize("bad", [gama(0), gama(0.00001), gama(40_000), chrm([0] * 8), chrm(SRGB_PRIMARIES[:2] * 4)])
def test_impossible_chunks_change_nothing(tmp_path, bad):
    assert off(tmp_path, png(eight_bits(srgb(COLOURS)), bad)) == 0


def test_a_cameras_tag_of_adobe_rgb(tmp_path):
    # One directory in another: of the picture, of the camera, of interoperability.
    entries = (0x8769, 4, 1, struct.pack("<I", 26)), (0xA005, 4, 1, struct.pack("<I", 44)), (1, 2, 4, b"R03\0")
    tags = b"Exif\0\0II*\0" + struct.pack("<I", 8)
    tags += b"".join(struct.pack("<HHHI", 1, *entry[:3]) + entry[3] + bytes(4) for entry in entries)
    stored = in_space(XYZ_TO_ADOBE, 1 / ADOBE_RGB[0])
    assert off(tmp_path, saved(stored, "JPEG", quality=98, subsampling=0, exif=tags)) < 1.5


def test_a_picture_in_lab(tmp_path):
    lab = ImageCms.profileToProfile(
        eight_bits(srgb(COLOURS)), ImageCms.createProfile("sRGB"), ImageCms.createProfile("LAB"), outputMode="LAB"
    )
    assert off(tmp_path, saved(lab, "TIFF")) < 2


def test_one_profile_is_that_of_littlecms(tmp_path):
    """LittleCMS' own sRGB profile is an independent witness that profiles are read as such."""
    own = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    assert off(tmp_path, saved(eight_bits(srgb(COLOURS)), icc_profile=own)) < 1
