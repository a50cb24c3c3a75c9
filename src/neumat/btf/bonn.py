"""Bonn's `.btf` files, read: the formats DFMF (UBO2014's) and FMF, which store a BTF as products of two factors.

For each of three channels, channel[picture, texel] = sum over k of directions[picture, k] texels[texel, k], where the
pictures are all lights for the first view, then for the second, and the texels run row by row from the top. A colour
model makes RGB of the channels. Blocks of pictures are multiplied out one at a time, so that memory stays bounded.
"""

import os
from pathlib import Path

import torch

from neumat.btf.bonn_header import DFMF, Fields, read_header
from neumat.btf.colour_models import DECODERS
from neumat.btf.directions import grid
from neumat.btf.picture_set import PictureSet
from neumat.errors import NeumatError
from neumat.files import reading

WHAT = "a .btf file"
SCALARS = {2: "<f2", 4: "<f4", 8: "<f8"}  # by their size in bytes
FMF_VERSION = 2  # the last that is known
# Colour models that the format knows and this reader refuses.
UNKNOWN = {2: "Lab", 3: "PCA", 4: "YCoCg", 5: "spectral", 6: "linear spectral"}


def read_bonn(path):
    """Return the PictureSet of a `.btf` file, and whether its header says that values contain the cosine of the light.

    Values below 0, which the factors leave around dark texels, become 0. Raises NeumatError for a file that is missing,
    damaged, of another format, version or colour model than are known, has pictures that aren't square, or goes on
    after its last factors.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        raise NeumatError(path, WHAT, "no regular file")
    with reading(path, WHAT), Path(path).open("rb") as file:
        fields = Fields(path, file)
        header = read_header(fields)
        if header.width != header.height:
            raise NeumatError(path, "square pictures", f"{header.width} x {header.height} texels")
        sizes = len(header.views) * len(header.lights), header.width * header.height
        model, factors = (_dfmf if header.signature == DFMF else _fmf)(fields, *sizes)
        fields.end()
    light, view = grid(header.views, header.lights)
    kind = header.signature.decode().strip("!")

    def read(part):
        return _pictures(path, factors, model, part, header.width)

    pictures = PictureSet(light, view, header.width, read, header.size_mm, 1.0, False, f"{Path(path).name} ({kind})")
    return pictures, header.cosine


def _pictures(path, factors, model, part, side):
    """Return the pictures (n, side, side, 3) of a slice, rows along +y."""
    channels = [(directions[part] @ texels.T).reshape(-1, side, side).flip(1) for directions, texels in factors]
    rgb = DECODERS[model](*channels)
    if not rgb.isfinite().all():
        raise NeumatError(path, "factors whose products are finite", "NaN or infinite values")
    return rgb.clamp_min(0)


def _dfmf(fields, pictures, texels):
    """Return the colour model and [(directions (pictures, k), texels (texels, k))] of a DFMF body's three channels."""
    most, model, *_ = fields.numbers("<Ii12f", "colour model")
    if model not in DECODERS:
        known = ", ".join(map(str, DECODERS))
        raise NeumatError(
            fields.path, f"a colour model of {known}", f"{model} ({UNKNOWN.get(model, 'of no known name')})"
        )
    factors = []
    for channel in "123":
        scalar = fields.numbers("<B", f"channel {channel}")[0]
        factors.append(_factors(fields, most, scalar, (pictures, texels), (texels, pictures)))
    return model, factors


def _fmf(fields, pictures, texels):
    """Return the same of an FMF body, which has one matrix: one of its factors has rows for each channel, the other
    is shared."""
    version = fields.numbers("<B", "version of the FMF header")[0]
    if version > FMF_VERSION:
        raise NeumatError(fields.path, f"an FMF header of version 0 to {FMF_VERSION}", version)
    logarithms = version >= 1 and fields.count("range reduction") != 0
    if version >= 2:
        fields.array("<f2", fields.numbers("<2I", "size of the height map"), "height map")
    most, scalar = fields.numbers("<IB", "count of components")
    shared = _factors(fields, most, scalar, (3 * pictures, texels), (3 * texels, pictures))
    split = [
        [factor[channel::3] if len(factor) == 3 * count else factor for channel in range(3)]
        for factor, count in zip(shared, (pictures, texels), strict=True)
    ]
    return (12 if logarithms else 0), list(zip(*split, strict=True))


def _factors(fields, most, scalar, size, swapped):
    """Return the factors of the next matrix, tensors: that of directions, then that of texels.

    size: its rows and columns where directions are the rows; swapped: the same where texels are.
    """
    if scalar not in SCALARS:
        raise NeumatError(fields.path, "scalars of 2, 4 or 8 bytes", f"{scalar} bytes")
    components, rows, columns = fields.numbers("<3I", "size of its factors")
    if not 0 < components <= most:
        raise NeumatError(fields.path, f"1 to {most} components, the most that it has", components)
    if (rows, columns) not in (size, swapped):
        raise NeumatError(fields.path, f"factors for a matrix of {size[0]} x {size[1]}", f"{rows} x {columns}")
    dtype = SCALARS[scalar]
    fields.array(dtype, (components,), "singular values")
    left, right = (torch.from_numpy(fields.array(dtype, (n, components), "factors")) for n in (rows, columns))
    return (left, right) if (rows, columns) == size else (right, left)
