"""The formats, and the one call that writes any of them."""

import importlib.metadata
import unicodedata
from pathlib import Path

import torch

from neumat.errors import NeumatError
from neumat.export.glsl import write_glsl
from neumat.export.keras import write_keras
from neumat.export.merl import write_field
from neumat.export.npy import SUFFIX, write_npy
from neumat.export.rgl import write_rgl
from neumat.export.safetensors import write_safetensors
from neumat.export.wgsl import write_wgsl
from neumat.fields.layout import SIZE, WIDTHS

# {format: (suffix, function(path, weights (675,), metadata))}; the only place to add a format.
EXPORTS = {
    "merl": (".binary", write_field),
    "rgl": (".bsdf", write_rgl),
    "npy": (SUFFIX, write_npy),
    "keras": (".h5", write_keras),
    "safetensors": (".safetensors", write_safetensors),
    "glsl": (".glsl", write_glsl),
    "wgsl": (".wgsl", write_wgsl),
}


def export(weights, format, folder, name, source="unknown"):
    """Write the field `weights` (675,) as `name` with the format's suffix in `folder`, and return the path.

    name: of the material; source: where its weights come from, for formats with metadata. For a set of files the path
    is that of the first. Raises NeumatError for an unknown format, a name that no file can have, another number of
    weights, and weights that are not finite.
    """
    check_name(name)
    if format not in EXPORTS:
        raise NeumatError("export", f"one of {', '.join(EXPORTS)}", repr(format))
    weights = torch.as_tensor(weights, dtype=torch.float32)
    if weights.shape != (SIZE,):
        raise NeumatError(name, f"({SIZE},) weights of widths {WIDTHS}", f"shape {tuple(weights.shape)}")
    if not torch.isfinite(weights).all():
        raise NeumatError(name, "finite weights", "NaN or infinite ones")
    suffix, write = EXPORTS[format]
    path = Path(folder, f"{name}{suffix}")
    write(path, weights, describe(name, source))
    return path


def check_name(name):
    """Raise NeumatError where `name` can't be a file's or would lead out of its folder."""
    unprintable = ("Cc", "Cs", "Zl", "Zp")  # control characters and line breaks, and bytes that are no text
    if name in ("", ".", "..") or any(c in "/\\" or unicodedata.category(c) in unprintable for c in name):
        raise NeumatError("export", "a name without slashes, line breaks and control characters", ascii(name))


def describe(name, source):
    """Return the metadata {text: text} of a field."""
    return {
        "name": name,
        "widths": "6-21-21-3, ReLU, linear last layer, f = max(exp(x) - 1, 0)",
        "layout": "W1 b1 W2 b2 W3 b3, kernels (in, out)",
        "units": "1/sr, linear RGB",
        "coordinates": "(hx, hy, hz, dx, dy, dz), Rusinkiewicz half and difference vectors, phi_d folded to [0, pi)",
        "source": str(source),
        "neumat": importlib.metadata.version("neumat"),
    }
