"""Users' image files, read as sRGB: any format and colour space, whatever their tags say, with bounded memory."""

import contextlib
import functools
import logging
import warnings

import numpy as np
from PIL import Image, ImageOps, PngImagePlugin, UnidentifiedImageError

from neumat.conditions.colour_spaces import TOLD_BY, to_srgb
from neumat.errors import NeumatError
from neumat.files import cause

LARGEST = 300e6  # pixels; phones make pictures of 200 million
MOST_MEMORY = 1.5e9  # bytes, of a picture as its decoder holds it
LARGEST_PROFILE = 1 << 26  # bytes of a colour profile or a text in a PNG file
STRIP = 1 << 22  # pixels that are converted at once
MID_GREY = 119  # sRGB, behind what is transparent
# Of many formats, those that users have, by their names in Pillow.
FORMATS = ("AVIF", "BMP", "GIF", "HEIF", "JPEG", "JPEG2000", "PNG", "PSD", "TIFF", "WEBP")
HEIF_BRANDS = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1")
STRAIGHT = {"RGBa": "RGBA", "La": "LA"}  # what colours that are multiplied by alpha are converted to
ORIENTATIONS = {
    2: Image.Transpose.FLIP_LEFT_RIGHT, 3: Image.Transpose.ROTATE_180, 4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE, 6: Image.Transpose.ROTATE_270, 7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_90,
}  # fmt: skip


def read_square(path, size, smallest=1):
    """Return the central square of an image file as uint8 sRGB (size, size, 3), transparency on mid grey.

    Raises NeumatError for a file that cannot be read as a whole, with its cause; for fewer than `smallest` pixels along
    a side; for more than LARGEST, or than MOST_MEMORY holds; and for values that are not finite.
    """
    try:
        # Warnings of tags and formats: what is read despite them is as good.
        with warnings.catch_warnings(action="ignore"), _open(path) as file:
            if min(file.size) < smallest:
                raise NeumatError(path, f"an image of at least {smallest} x {smallest} pixels", file.size)
            pixels = file.width * file.height
            if pixels > LARGEST:
                raise NeumatError(path, f"an image of at most {LARGEST / 1e6:g} megapixels", file.size)
            file.draft("RGB", (4 * size, 4 * size))  # a huge JPEG is read at a fraction of its size
            needed = _memory(file, pixels)
            if needed > MOST_MEMORY:
                raise NeumatError(
                    path, f"an image that takes at most {MOST_MEMORY / 1e9:g} GB", f"{needed / 1e9:.1f} GB"
                )
            turn = ORIENTATIONS.get(_load(file))
            _check_space(path, file)
            square = _square(file, size)
            return np.array(square if turn is None else square.transpose(turn))
    except NeumatError:
        raise
    except Exception as error:  # of broken files Pillow's decoders raise nearly every kind
        raise NeumatError(path, f"a whole image file ({readable()})", _found(path, error)) from error


def readable():
    """Return the image formats that can be read here, in words."""
    _register_heif()
    Image.init()
    names = [name for name in FORMATS if name in Image.OPEN]
    return ", ".join(names) + ("" if "HEIF" in names else "; HEIC with the package pillow-heif")


@functools.cache
def _register_heif():
    with contextlib.suppress(ImportError):
        from pillow_heif import register_heif_opener

        register_heif_opener()


@contextlib.contextmanager
def _open(path):
    """Open an image with our limits in place of Pillow's, which refuse what phones make and large colour profiles."""
    _register_heif()
    limits = Image.MAX_IMAGE_PIXELS, PngImagePlugin.MAX_TEXT_CHUNK
    Image.MAX_IMAGE_PIXELS, PngImagePlugin.MAX_TEXT_CHUNK = None, LARGEST_PROFILE
    try:
        # By its name, Pillow would map some files into memory, and misread TIFF files that are stored on their side.
        with open(path, "rb") as stream, Image.open(stream) as file:
            yield file
    finally:
        Image.MAX_IMAGE_PIXELS, PngImagePlugin.MAX_TEXT_CHUNK = limits


def _load(file):
    """Decode a file, and return its orientation; 1, as it is stored, where its tags can't be read."""
    if file.format == "TIFF":
        orientation = _orientation(file)
        # At the end of loading Pillow would turn the picture, and write its tags, which can fail; its size is of what
        # would be turned.
        file.load_end = lambda: setattr(file, "_size", file.im.size)
        file.load()
    else:
        file.load()  # PNG files may have their tags at the end
        orientation = _orientation(file)
    return orientation


def _orientation(file):
    try:
        return file.getexif().get(0x0112)
    except Exception:  # of broken tags Pillow raises nearly every kind
        return 1


def _memory(file, pixels):
    """Return about how many bytes it takes to decode a file, of which so many pixels are stored."""
    bands = len(file.getbands())
    if file.info.get("progressive"):
        return 2 * bands * pixels  # all coefficients, at whatever fraction it is read
    return (24 if file.mode[0] in "IF" else bands) * file.width * file.height  # `_grey` works in double precision


def _found(path, error):
    """Return in words why an image file could not be read."""
    found = cause(path, error)
    if found != "a damaged or foreign file":
        return found
    with open(path, "rb") as file:
        head = file.read(12)
    if head[4:8] == b"ftyp" and head[8:] in HEIF_BRANDS and isinstance(error, UnidentifiedImageError):
        return "a HEIC file"
    if isinstance(error, UnidentifiedImageError):
        return "an empty file" if not head else "another kind of file, or a damaged one"
    return str(error) or type(error).__name__


def _square(image, size):
    """Return the central square of an image as RGB, (size, size), sRGB.

    Larger ones are converted strip by strip, and reduced at once: what is held is small beside the image itself.
    """
    if image.mode[0] in "IF":
        image = _grey(image)
    factor = min(image.size) // (4 * size)
    if factor < 2:
        return ImageOps.fit(_rgb(image), (size, size), Image.Resampling.BOX, centering=(0.5, 0.5))
    side = min(image.size) // factor * factor
    left, top = ((n - side) // 2 for n in image.size)
    reduced, rows = Image.new("RGB", (side // factor, side // factor)), max(1, STRIP // (side * factor)) * factor
    for start in range(0, side, rows):
        strip = image.crop((left, top + start, left + side, top + min(start + rows, side)))
        reduced.paste(_rgb(strip).reduce(factor), (0, start // factor))
    return reduced.resize((size, size), Image.Resampling.BOX)


def _grey(image):
    """Return an image of deeper grey as one of 8 bits, scaled, not clipped: 16 bits by their range, 32 bits and floats
    by their maximum."""
    grey = np.asarray(image, np.float64)
    if not np.isfinite(grey).all():
        raise ValueError("values that are not finite")
    top = max(grey.max(), 65535 if image.mode.startswith("I") else 1e-12)
    scaled = Image.fromarray((grey.clip(0, top) / top * 255).round().astype(np.uint8))
    scaled.info = {key: value for key, value in image.info.items() if key != "transparency"}
    return scaled


def _check_space(path, image):
    """Say so, and take an image for sRGB, where its colour space can't be read."""
    try:
        to_srgb(image.crop((0, 0, 1, 1)))
    except Exception:  # of broken profiles LittleCMS' binding raises several kinds
        logging.warning("%s: its colour space can't be read: taken for sRGB", path)
        image.info = {key: value for key, value in image.info.items() if key not in TOLD_BY}


def _rgb(image):
    """Return an image as RGB, sRGB, with what is transparent before mid grey."""
    if image.mode in STRAIGHT:
        image = image.convert(STRAIGHT[image.mode])
    colours = to_srgb(image)
    if image.mode[-1] != "A" and "transparency" not in image.info:
        return colours
    return Image.composite(
        colours, Image.new("RGB", image.size, (MID_GREY,) * 3), image.convert("RGBA").getchannel("A")
    )
