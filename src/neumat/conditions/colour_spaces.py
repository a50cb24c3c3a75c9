"""Pictures of other colour spaces as sRGB: by an ICC profile, by a PNG file's chunks, by a camera's tag."""

import io

import numpy as np
from PIL import Image, ImageCms

SRGB_PRIMARIES = (0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06)  # x, y of white, red, green and blue
ADOBE_RGB = 256 / 563, (0.3127, 0.3290, 0.64, 0.33, 0.21, 0.71, 0.15, 0.06)  # gAMA and primaries (Adobe RGB (1998))
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
SPACES = {"RGB": "RGB ", "L": "GRAY", "CMYK": "CMYK"}  # what the profile of an image in Pillow's mode must be of
TOLD_BY = ("icc_profile", "gamma", "chromaticity")  # keys of what Pillow knows of an image
GAMMAS = (0.05, 20)  # exponents of PNG files beyond these are mistakes
INTENT, FLAGS = ImageCms.Intent.RELATIVE_COLORIMETRIC, ImageCms.Flags.BLACKPOINTCOMPENSATION


def to_srgb(image):
    """Return a Pillow image as RGB, sRGB, without its transparency.

    Its colour space is told, in this order, by an ICC profile, the PNG chunks sRGB, or gAMA and cHRM, and the tag of
    Adobe RGB that cameras write; without any it is sRGB. Raises several exceptions for what is broken or impossible.
    """
    if image.mode == "LAB":
        return ImageCms.profileToProfile(image, ImageCms.createProfile("LAB"), _srgb(), INTENT, "RGB", flags=FLAGS)
    if image.mode not in SPACES:
        image = image.convert("L" if image.mode in ("1", "LA") or image.mode[0] in "IF" else "RGB")
    if image.info.get("icc_profile"):
        profile = ImageCms.ImageCmsProfile(io.BytesIO(image.info["icc_profile"]))
        space = profile.profile.xcolor_space
        if space == "RGB " and image.mode == "L":
            image = image.convert("RGB")
        if space != SPACES[image.mode]:
            raise ValueError(f"a profile of {space}")
        return ImageCms.profileToProfile(image, profile, _srgb(), INTENT, "RGB", flags=FLAGS)
    rgb = image.convert("RGB")
    if "srgb" in image.info or not (told := _told(image)):
        return rgb
    return Image.fromarray(_converted(np.asarray(rgb), *told))


def _srgb():
    return ImageCms.createProfile("sRGB")


def _told(image):
    """Return (gamma or None for sRGB's curve, primaries) of an image that tells them without a profile, else None."""
    gamma, primaries = image.info.get("gamma"), image.info.get("chromaticity")
    if gamma is not None and not GAMMAS[0] <= gamma <= GAMMAS[1]:
        gamma = None
    if gamma or primaries:
        return gamma, primaries or SRGB_PRIMARIES
    return ADOBE_RGB if _tagged_adobe(image) else None


def _tagged_adobe(image):
    """Return whether a camera's tags say Adobe RGB (DCF 2.0, section 5.4: the interoperability index R03)."""
    try:
        return image.getexif().get_ifd(0xA005).get(1) in ("R03", b"R03")
    except Exception:  # of broken tags Pillow raises nearly every kind
        return False


def _converted(rgb, gamma, primaries):
    """Return uint8 sRGB (h, w, 3) of uint8 values with this encoding exponent, as of gAMA (None: sRGB's curve), and
    these primaries."""
    code = np.arange(256) / 255
    linear = code ** (1 / gamma) if gamma else np.where(code > 0.04045, ((code + 0.055) / 1.055) ** 2.4, code / 12.92)
    matrix = np.linalg.inv(_to_xyz(SRGB_PRIMARIES)) @ _to_xyz(primaries)
    values = linear.astype(np.float32)[rgb] @ matrix.T.astype(np.float32)
    values = np.where(values > 0.0031308, 1.055 * values.clip(1e-9) ** (1 / 2.4) - 0.055, 12.92 * values)
    return (values.clip(0, 1) * 255).round().astype(np.uint8)


def _to_xyz(primaries):
    """Return the matrix (3, 3) from linear RGB to XYZ under sRGB's white, to which theirs is adapted (Bradford)."""
    x, y = np.array(primaries, float).reshape(4, 2).T
    with np.errstate(all="raise"):
        white, *_ = columns = np.stack([x / y, np.ones(4), (1 - x - y) / y], 1)
    matrix = columns[1:].T * np.linalg.solve(columns[1:].T, white)
    x, y = SRGB_PRIMARIES[:2]
    ours = np.array([x / y, 1, (1 - x - y) / y])
    return np.linalg.inv(BRADFORD) @ np.diag(BRADFORD @ ours / (BRADFORD @ white)) @ BRADFORD @ matrix
