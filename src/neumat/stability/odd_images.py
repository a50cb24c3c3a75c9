"""Image files as users have them: unusual but whole ones, and ones that no condition can be read from."""

import struct
import zlib

import numpy as np
from PIL import Image

RED, BLUE = (200, 25, 20), (25, 40, 200)  # sRGB
EXIF_ORIENTATION = 0x0112


def ball(colour, size=128):
    """Return a Pillow image of a glossy ball of an sRGB colour under a lamp at the upper left, before mid grey."""
    y, x = np.mgrid[:size, :size] / size * 2.2 - 1.1
    inside = x**2 + y**2 < 1
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    shade = np.maximum(-0.5 * x - 0.5 * y + 0.7 * z, 0) + 0.15
    highlight = np.maximum(-0.3 * x - 0.3 * y + 0.9 * z, 0) ** 60
    picture = np.where(inside[..., None], shade[..., None] * colour + 220 * highlight[..., None], 119)
    return Image.fromarray(picture.clip(0, 255).astype(np.uint8))


def _clear(path):
    picture = ball(RED).convert("RGBA")
    picture.putalpha(Image.fromarray(((np.asarray(ball((0, 0, 0))) != 119).any(2) * 255).astype(np.uint8)))
    picture.save(path)


def _clear_palette(path):
    picture = ball(RED).convert("P", palette=Image.Palette.ADAPTIVE)
    picture.save(path, transparency=picture.getpixel((0, 0)))


def _deep_grey(path):
    Image.fromarray(np.asarray(ball(RED).convert("L")).astype(np.uint16) * 257).save(path)


def _turned(path):
    exif = Image.Exif()
    exif[EXIF_ORIENTATION] = 6  # shown a quarter turn clockwise from how it is stored
    ball(RED).rotate(90).save(path, exif=exif, quality=95)


def _truncated(path):
    ball(RED).save(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _not_finite(path):
    values = np.asarray(ball(RED).convert("L"), np.float32)
    values[0, 0] = np.nan
    Image.fromarray(values).save(path)


def _gigapixel(path):
    ball(RED).save(path)
    data = bytearray(path.read_bytes())
    data[16:24] = struct.pack(">II", 40_000, 30_000)  # the size that a PNG file's header tells
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    path.write_bytes(data)


# {what: (file name, function that writes `ball(RED)` to a path, the mode of Pillow that holds what is left of it)}
UNUSUAL = {
    "with alpha": ("alpha.png", _clear, "RGB"),
    "palette with transparency": ("palette.png", _clear_palette, "RGB"),
    "greyscale": ("grey.png", lambda path: ball(RED).convert("L").save(path), "L"),
    "16-bit": ("deep.png", _deep_grey, "L"),
    "CMYK": ("cmyk.jpg", lambda path: ball(RED).convert("CMYK").save(path, quality=95), "RGB"),
    "stored on its side (EXIF)": ("turned.jpg", _turned, "RGB"),
    "huge, 6000 x 6000": ("huge.jpg", lambda path: ball(RED).resize((6000, 6000), Image.NEAREST).save(path), "RGB"),
}
# {what: (file name, function that writes it to a path, part of the message)}
BROKEN = {
    "black": ("black.png", lambda path: Image.new("RGB", (64, 64)).save(path), "one even colour"),
    "white": ("white.png", lambda path: Image.new("RGB", (64, 64), "white").save(path), "one even colour"),
    "all transparent": ("clear.png", lambda path: Image.new("RGBA", (64, 64)).save(path), "one even colour"),
    "tiny, 8 x 8": ("tiny.png", lambda path: ball(RED, 8).save(path), "at least 16 x 16"),
    "1200 megapixels": ("gigapixel.png", _gigapixel, "an image of at most 300 megapixels"),
    "truncated": ("cut.png", _truncated, "a whole image file"),
    "not finite": ("float.tif", _not_finite, "not finite"),
    "not an image": ("text.png", lambda path: path.write_text("words"), "another kind of file"),
    "empty file": ("empty.png", lambda path: path.touch(), "an empty file"),
    "a folder": ("folder.png", lambda path: path.mkdir(), "a folder"),
    "no such file": ("missing.png", lambda path: None, "no such file"),
}
