"""The header of Bonn's `.btf` files: where they were measured, and at how many texels.

Little endian: the signature; the meta data, whose length comes first; the directions, light by light for each view;
width and height; local frames, which no value here depends on. What follows is read by `neumat.btf.bonn`.
"""

import math
import os
import struct
from dataclasses import dataclass

import numpy as np
import torch

from neumat.btf.directions import spherical
from neumat.errors import NeumatError

DFMF, FMF = b"!DFMF08FCR", b"!FMF12FCER"
SIGNATURES = (DFMF, FMF, b"!FMF06FCR", b"!FMF06FC", b"!PVF06FCR", b"!PVF06FC", b"!BDIF06R2!")
META = "<I80s80s80sf3f"  # version, setup, sensor, light source, texels a mm, scale of RGB
MOST_DIRECTIONS = 10_000
LARGEST_SIDE = 16384  # texels


@dataclass
class Header:
    """What a `.btf` file says of its values: signature; directions of light (l, 3) and view (v, 3); width and height in
    texels; size_mm of the width, None where it isn't told; cosine: whether values contain the cosine of the light."""

    signature: bytes
    lights: torch.Tensor
    views: torch.Tensor
    width: int
    height: int
    size_mm: float | None
    cosine: bool


class Fields:
    """The fields of an open binary file, read one after the other; none is allocated before the file is known to hold
    it."""

    def __init__(self, path, file):
        self.path, self.file = path, file
        self.left = os.fstat(file.fileno()).st_size

    def bytes(self, count, what):
        """Return the next `count` bytes; raises NeumatError where the file ends before."""
        data = self.file.read(count) if count <= self.left else b""
        if len(data) != count:
            raise NeumatError(
                self.path, f"a whole .btf file, with {count} bytes of {what}", f"its end after {self.left}"
            )
        self.left -= count
        return data

    def numbers(self, layout, what):
        """Return a tuple of numbers in struct's notation."""
        return struct.unpack(layout, self.bytes(struct.calcsize(layout), what))

    def count(self, what):
        """Return the next u32."""
        return self.numbers("<I", what)[0]

    def array(self, dtype, shape, what):
        """Return the next numbers as float32 array of `shape`; raises NeumatError for NaN and infinite ones."""
        dtype = np.dtype(dtype)
        data = np.frombuffer(self.bytes(math.prod(shape) * dtype.itemsize, what), dtype).reshape(shape)
        with np.errstate(over="ignore", invalid="ignore"):
            data = data.astype(np.float32)
        if not np.isfinite(data).all():
            raise NeumatError(self.path, f"finite numbers in its {what}", "NaN or infinite ones")
        return data

    def end(self):
        """Raise NeumatError where the file goes on."""
        if self.left:
            raise NeumatError(self.path, "the end of the file after its last factors", f"{self.left} bytes more")


def read_header(fields):
    """Return the Header that Fields start with, from the first byte on.

    Raises NeumatError for another signature than DFMF and FMF, another version, other than three channels, directions
    below the horizon, lights that differ between views, and counts that are 0 or beyond MOST_DIRECTIONS and
    LARGEST_SIDE.
    """
    path, signature = fields.path, _signature(fields)
    density, cosine = _meta(fields)
    lights, views = _directions(fields)
    width, height = fields.numbers("<2I", "width and height")
    if not (0 < width <= LARGEST_SIDE and 0 < height <= LARGEST_SIDE):
        raise NeumatError(path, f"a width and a height of 1 to {LARGEST_SIDE} texels", f"{width} x {height}")
    if signature.endswith(b"R"):
        fields.array("<f4", (fields.count("count of local frames"), 9), "local frames")
    size_mm = width / density if density else None
    return Header(signature, lights, views, width, height, size_mm, cosine)


def _signature(fields):
    expected = "a .btf file of the University of Bonn, DFMF08FCR or FMF12FCER"
    longest = max(map(len, SIGNATURES))
    head = fields.file.read(longest)
    found = next((signature for signature in sorted(SIGNATURES, key=len)[::-1] if head.startswith(signature)), None)
    if found not in (DFMF, FMF):
        raise NeumatError(fields.path, expected, found.decode().strip("!") if found else "another kind of file")
    fields.left -= len(found)
    return found


def _meta(fields):
    """Return texels a mm, None where that is no number above 0, and whether the header says cosine."""
    before = fields.left
    size = fields.count("meta data")
    version, *_, density, _, _, _ = fields.numbers(META, "meta data")
    if not 1 <= version <= 4:
        raise NeumatError(fields.path, "meta data of version 1 to 4", version)
    cosine = bool(version > 1 and fields.count("meta data"))
    if version > 2:
        fields.bytes(fields.count("length of its XML text"), "XML text")
    if version > 3:
        channels = fields.count("count of channels")
        if channels != 3:
            raise NeumatError(fields.path, "three channels", channels)
        for _ in range(channels):
            fields.bytes(fields.count("length of a channel's name"), "a channel's name")
    if size != before - fields.left:
        raise NeumatError(fields.path, f"meta data of {before - fields.left} bytes", size)
    return (density if 0 < density < math.inf else None), cosine


def _directions(fields):
    """Return lights (l, 3) and views (v, 3)."""
    path, views, lights = fields.path, [], None
    for number in range(_counted(fields, "views")):
        views.append(fields.array("<f4", (2,), f"view {number}"))
        found = fields.array("<f4", (_counted(fields, "lights"), 2), f"lights of view {number}")
        lights = found if lights is None else lights
        if not np.array_equal(found, lights):
            raise NeumatError(path, "the same lights for every view", f"others for view {number} than for view 0")
    result = []
    for name, angles in (("light", lights), ("view", np.stack(views))):
        if not ((angles[:, 0] >= 0) & (angles[:, 0] < math.pi / 2 + 1e-3)).all():
            raise NeumatError(path, f"{name} directions with theta of 0 to pi / 2", "others")
        result.append(spherical(*torch.from_numpy(angles).double().unbind(-1)).float())
    return result


def _counted(fields, what):
    count = fields.count(f"count of {what}")
    if not 0 < count <= MOST_DIRECTIONS:
        raise NeumatError(fields.path, f"1 to {MOST_DIRECTIONS} {what}", count)
    return count
