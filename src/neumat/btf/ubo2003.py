"""Sets of pictures as UBO2003 and ATRIUM have them: a folder or a zip of JPEG or Radiance HDR files, read strictly.

A picture is called `00008 tl000 pl000 tv030 pv030.jpg`: its number, 81 light + view, and theta and phi of light and
view in degrees, each one of the 81 directions of `directions.ubo2003_directions`. It lies in the folder given, or below
it in the folder of its view, `tv030_pv030`. Every view that is there must be there under all 81 lights.
"""

import contextlib
import io
import os
import re
import warnings
import zipfile
from pathlib import Path, PurePosixPath

import numpy as np
import torch
from PIL import Image, UnidentifiedImageError

from neumat.btf.directions import UBO2003, grid, ubo2003_directions
from neumat.btf.picture_set import PictureSet
from neumat.btf.rgbe import decode_rgbe
from neumat.errors import NeumatError
from neumat.files import reading

WHAT = "a folder or zip of BTF pictures"
NAME = re.compile(r"(\d{5}) tl(\d{3}) pl(\d{3}) tv(\d{3}) pv(\d{3})\.(jpe?g|hdr)", re.I)
PICTURE = re.compile(r".*\.(jpe?g|hdr|exr|png|tiff?|bmp|ppm)", re.I)
EXAMPLE = "00008 tl000 pl000 tv030 pv030.jpg"
ANGLES = [
    (theta, round(360 * j / count)) for theta, count, _ in zip(*UBO2003, strict=True) for j in range(count)
]  # fmt: skip
MOST_FILES = 20_000
LARGEST_FILE = 1 << 27  # bytes of one picture's file
LARGEST_SIDE = 4096  # pixels
LARGEST_RATIO = 100  # of a picture's size to what it takes in a zip
JPEG_SCALE = 1 / np.pi  # white, lit along the normal, is taken for a perfect diffuser


def read_ubo2003(path, gamma=2.2):
    """Return the PictureSet in a folder or a zip. gamma: JPEGs hold linear values to the power of 1 / gamma.

    The scale is 1 / pi for JPEGs, whose unit nobody tells, and 1 for HDRs. Raises NeumatError for a set that is missing
    or damaged, whose names aren't as said, or that lacks a picture; its `read` does for a picture that is no RGB of 8
    bits (JPEG) or RGBE (HDR), that isn't square, or is of another size than the first.
    """
    with _opened(path) as files:
        found = _numbered(path, files)
        views = sorted({number % len(ANGLES) for number in found})
        wanted = [light * len(ANGLES) + view for view in views for light in range(len(ANGLES))]
        for number in wanted:
            if number not in found:
                raise NeumatError(path, f"all {len(ANGLES)} lights of every view", f"no {_name(number)}")
        suffixes = {PurePosixPath(name).suffix.lower().replace("jpeg", "jpg") for name in found.values()}
        if len(suffixes) > 1:
            raise NeumatError(path, "pictures of one format", " and ".join(sorted(suffixes)))
        names = [found[number] for number in wanted]
        side = len(_picture(path, names[0], files.read(names[0]), gamma))

    def read(part):
        with _opened(path) as files:
            pictures = [_picture(path, name, files.read(name), gamma, side) for name in names[part]]
        return torch.from_numpy(np.stack(pictures))

    directions = ubo2003_directions()
    return PictureSet(
        *grid(directions[views], directions),
        side,
        read,
        size_mm=None,
        scale=1.0 if suffixes == {".hdr"} else JPEG_SCALE,
        partial=len(views) < len(ANGLES),
        source=f"{Path(path).name} ({len(views)} of {len(ANGLES)} views)",
    )


def _name(number):
    """Return the name of a picture, without its suffix."""
    light, view = divmod(number, len(ANGLES))
    return "{:05} tl{:03} pl{:03} tv{:03} pv{:03}".format(number, *ANGLES[light], *ANGLES[view])


def _numbered(path, files):
    """Return {number: name} of the pictures among the files of a set."""
    found = {}
    for name in files.names:
        parts = PurePosixPath(name)
        if parts.name.startswith(".") or "__MACOSX" in parts.parts or not PICTURE.fullmatch(parts.name):
            continue  # a system's own files, texts
        match = NAME.fullmatch(parts.name)
        number = int(match[1]) if match else len(ANGLES) ** 2
        if number >= len(ANGLES) ** 2 or not parts.name.startswith(_name(number)):
            raise NeumatError(path, f"names like {EXAMPLE} (or .hdr), of UBO2003's directions", repr(name))
        folder = parts.parent.name
        if re.fullmatch(r"tv\d{3}_pv\d{3}", folder) and folder != f"tv{match[4]}_pv{match[5]}":
            raise NeumatError(path, "every picture in the folder of its view", repr(name))
        if number in found:
            raise NeumatError(path, "each picture once", f"{found[number]!r} and {name!r}")
        found[number] = name
    if not found:
        raise NeumatError(path, f"pictures with names like {EXAMPLE}", "none")
    return found


def _picture(path, name, data, gamma, side=None):
    """Return the picture (side, side, 3), float32, linear RGB, rows along +y, of the bytes of a file."""
    where = f"{path}: {name}"
    hdr = name.lower().endswith(".hdr")
    try:
        linear = decode_rgbe(data, LARGEST_SIDE) if hdr else _jpeg(data) ** np.float32(gamma)
    except Exception as error:  # of broken pictures Pillow raises nearly every kind
        what = "a Radiance HDR picture (RGBE)" if hdr else "a JPEG picture of 8-bit RGB"
        unknown = isinstance(error, UnidentifiedImageError)
        cause = "another kind of file, or a damaged one" if unknown else str(error) or type(error).__name__
        raise NeumatError(where, f"{what} of at most {LARGEST_SIDE} pixels a side", cause) from error
    height, width = linear.shape[:2]
    if height != width or side not in (None, height):
        wanted = f"a picture of {side} x {side} pixels, as the first" if side else "a square picture"
        raise NeumatError(where, wanted, f"{width} x {height}")
    if not np.isfinite(linear).all():
        raise NeumatError(where, "finite values", "infinite ones")
    return linear[::-1]


def _jpeg(data):
    """Return the picture (h, w, 3), float32, 0 to 1, of a JPEG file's bytes."""
    # Limits are ours, and checked before anything is decoded.
    with warnings.catch_warnings(action="ignore"), Image.open(io.BytesIO(data), formats=["JPEG"]) as file:
        if max(file.size) > LARGEST_SIDE:
            raise ValueError(f"{file.width} x {file.height} pixels")
        if file.mode != "RGB":
            raise ValueError(f"one of colour mode {file.mode}")
        return np.asarray(file, np.float32) / 255


@contextlib.contextmanager
def _opened(path):
    """Yield the files of a folder or a zip, which have `names` and `read(name)`."""
    path = Path(path)
    if os.path.isdir(path):
        yield _Folder(path)
        return
    if os.path.exists(path) and not os.path.isfile(path):
        raise NeumatError(path, WHAT, "no regular file")
    with contextlib.ExitStack() as stack:
        with reading(path, WHAT):
            files = _Zip(path, stack.enter_context(zipfile.ZipFile(path)))
        yield files


class _Folder:
    """The files of a folder and of those directly below it."""

    def __init__(self, path):
        self.path = path
        with reading(path, WHAT):
            found = [*path.glob("*"), *path.glob("*/*")]
            self.names = [str(file.relative_to(path)) for file in found if not file.is_dir()]

    def read(self, name):
        """Return a file's bytes; raises NeumatError for one that can't be read or is too large."""
        file = self.path / name
        with reading(file, "a picture"):
            if os.path.exists(file) and not os.path.isfile(file):
                raise NeumatError(file, "a picture", "no regular file")
            size = file.stat().st_size
            if size > LARGEST_FILE:
                raise NeumatError(file, f"a picture of at most {LARGEST_FILE} bytes", size)
            return file.read_bytes()


class _Zip:
    """The files of a zip, none of which is unpacked to a disk."""

    def __init__(self, path, archive):
        self.path, self.archive = path, archive
        members = [member for member in archive.infolist() if not member.is_dir()]
        if len(members) > MOST_FILES:
            raise NeumatError(path, f"a zip of at most {MOST_FILES} files", len(members))
        for member in members:
            parts = PurePosixPath(member.filename.replace("\\", "/"))
            if parts.is_absolute() or ".." in parts.parts:
                raise NeumatError(path, "names that stay inside the zip", repr(member.filename))
        self.names = [member.filename for member in members]
        if len(set(self.names)) < len(self.names):
            raise NeumatError(path, "each name once", "a name twice")

    def read(self, name):
        """Return a file's bytes; raises NeumatError for one that can't be read or is too large once unpacked."""
        member = self.archive.getinfo(name)
        packed = member.compress_size  # as much is allocated, whatever the zip holds
        if packed > LARGEST_FILE or member.file_size > min(LARGEST_FILE, LARGEST_RATIO * max(packed, 1)):
            wanted = f"at most {LARGEST_FILE} bytes, and {LARGEST_RATIO} times their compressed size"
            raise NeumatError(f"{self.path}: {name}", wanted, f"{member.file_size} from {packed}")
        with reading(self.path, WHAT):
            return self.archive.read(member)
