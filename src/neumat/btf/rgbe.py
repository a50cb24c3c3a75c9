"""Radiance `.hdr` pictures (RGBE: 8-bit mantissas of R, G and B, one exponent), decoded from bytes that nobody vouches
for: Mitsuba's reader corrupts memory on damaged ones."""

import re

import numpy as np

HEADER = re.compile(rb"#\?(?:RADIANCE|RGBE)\n(?P<lines>(?:[^\n]+\n)*)\n-Y (?P<height>\d{1,5}) \+X (?P<width>\d{1,5})\n")
FORMAT = b"FORMAT=32-bit_rle_rgbe"
SHORTEST, LONGEST = 8, 32767  # of the rows that are compressed


def decode_rgbe(data, largest):
    """Return the picture (h, w, 3), float32, linear RGB, of a file's bytes; its rows run from the top.

    Raises ValueError, with what is found in words, for damaged data, sides beyond `largest`, other colour spaces (XYZE)
    and other orders of pixels than rows from the top left.
    """
    match = HEADER.match(data)
    if match is None or FORMAT not in match["lines"].splitlines():
        raise ValueError("another or a damaged header")
    height, width = int(match["height"]), int(match["width"])
    if not (0 < height <= largest and 0 < width <= largest):
        raise ValueError(f"{width} x {height} pixels")
    pixels, end = _pixels(data, match.end(), height, width)
    if end != len(data):
        raise ValueError("more data than pixels")
    exposure = np.prod([float(e) for e in re.findall(rb"^EXPOSURE=\s*([0-9.eE+-]+)\s*$", match["lines"], re.M)])
    if not 0 < exposure < np.inf:
        raise ValueError(f"an exposure of {exposure:g}")
    # Exponents are stored plus 128, mantissas times 256; an exponent of 0 means black.
    scale = np.ldexp(np.where(pixels[..., 3:] == 0, 0.0, 1.0), pixels[..., 3:].astype(int) - 136)
    with np.errstate(over="ignore"):
        return (pixels[..., :3] * scale / exposure).astype(np.float32)


def _pixels(data, at, height, width):
    """Return the RGBE bytes (h, w, 4) from position `at` of the data on, and where they end."""
    start = bytes((2, 2, width >> 8, width & 255))
    if not (SHORTEST <= width <= LONGEST and data.startswith(start, at)):
        size = 4 * height * width
        if len(data) - at < size:
            raise ValueError("an end before the last pixel")
        return np.frombuffer(data, np.uint8, size, at).reshape(height, width, 4), at + size
    rows = []
    for _ in range(height):
        if not data.startswith(start, at):
            raise ValueError("a row without its start")
        row, at = _row(data, at + len(start), 4 * width)
        rows.append(np.frombuffer(row, np.uint8).reshape(4, width))
    return np.stack(rows).transpose(0, 2, 1), at


def _row(data, at, size):
    """Return `size` bytes that are stored in runs from position `at` on, and where they end."""
    row = bytearray()
    while len(row) < size:
        if at + 1 >= len(data):
            raise ValueError("an end before the last pixel")
        count = data[at]
        if count > 128:  # a run of one value
            row += data[at + 1 : at + 2] * (count - 128)
            at += 2
        else:
            row += data[at + 1 : at + 1 + count]
            at += 1 + count
        if count == 0 or len(row) > size or at > len(data):
            raise ValueError("a damaged run")
    return row, at
