"""Source code of a field, in any language that looks like C: straight lines, weights as constants."""

import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from neumat.export.parts import split
from neumat.fields.field import LARGEST_LOG
from neumat.files import atomic_path

TINY = "1e-7"  # below it the half vector is the normal, and its azimuth 0


@dataclass(frozen=True)
class Language:
    """What differs between shading languages.

    signature: of the function, with {name} in place of its name; number, vector: what declares a constant; vector3:
    the type of three numbers; choose: (condition, then, otherwise) -> expression.
    """

    signature: str
    number: str
    vector: str
    vector3: str
    choose: Callable


def write_source(path, weights, metadata, language):
    """Write the field (675,) as a function of a shading `language`."""
    with atomic_path(path) as temporary:
        temporary.write_text(source(weights, metadata, language), encoding="utf-8")


def function_name(name):
    """Return the name of the function for a material, another one for every name: "chrome" makes brdf_chrome.

    Where a character is none of ASCII's letters and numbers, it becomes an underscore, and a digest of the name tells
    it from others: "blend-000@rbg" makes brdf_blend_000_rbg_ and twelve digits.
    """
    if re.fullmatch(r"[A-Za-z0-9]+", name):
        return f"brdf_{name}"
    # Two underscores in a row are reserved in GLSL. What follows "brdf_" holds at least one, as no plain name does.
    words = re.findall(r"[A-Za-z0-9]+", name) or ["x"]
    return "_".join(["brdf", *words, hashlib.sha256(name.encode()).hexdigest()[:12]])


def source(weights, metadata, language):
    """Return the function's text: (wi, wo), unit vectors with the normal as z -> f, RGB, 1/sr; 0 below the horizon.

    Half and difference vectors as in neumat.brdf.coordinates. Swapping wi and wo changes the sign of their difference
    and nothing else, whatever is rounded, and the sign is dropped: f is reciprocal to the last bit.
    """
    number, vector, choose = language.number, language.vector, language.choose
    lines = [
        f"if (wi.z <= 0.0 || wo.z <= 0.0) {{ return {language.vector3}(0.0, 0.0, 0.0); }}",
        f"{vector} both = wi + wo;",
        f"{vector} d = 0.5 * (wi - wo);",
        f"{number} extent = length(both);",
        f"{vector} h = both / extent;",
        f"{number} hx = length(h.xy);  // the half vector, turned to azimuth 0",
        f"{number} cos_phi = {choose(f'hx > {TINY}', f'h.x / max(hx, {TINY})', '1.0')};",
        f"{number} sin_phi = {choose(f'hx > {TINY}', f'h.y / max(hx, {TINY})', '0.0')};",
        f"{number} x = h.z * (cos_phi * d.x + sin_phi * d.y) - hx * d.z;",
        f"{number} y = cos_phi * d.y - sin_phi * d.x;",
        f"{number} side = {choose('y < 0.0 || (y == 0.0 && x < 0.0)', '-1.0', '1.0')};",
    ]
    # The second component of the half vector is always 0.
    names = ["hx", None, "h.z", "(side * x)", "(side * y)", "(0.5 * extent)"]
    parts = split(weights)
    for prefix, kernel, bias in zip("abr", parts[::2], parts[1::2], strict=True):
        sums = [_sum(column, b, names) for column, b in zip(kernel.T, bias, strict=True)]
        if prefix != "r":
            sums = [f"max(0.0, {text})" for text in sums]
        names = [f"{prefix}{i}" for i in range(len(sums))]
        lines += [f"{number} {name} = {text};" for name, text in zip(names, sums, strict=True)]
    vector3 = language.vector3
    bounded = ", ".join(f"min({name}, {LARGEST_LOG})" for name in names)
    lines.append(f"return max(exp({vector3}({bounded})) - 1.0, {vector3}(0.0, 0.0, 0.0));")
    # Shading languages of old take ASCII only, in comments too.
    header = [f"// {key}: {ascii(value)[1:-1]}" for key, value in metadata.items()]
    header.append("// wi, wo: unit vectors to light and view, the normal is z; returns f, 1/sr, without the cosine")
    signature = language.signature.format(name=function_name(metadata["name"]))
    return "\n".join([*header, f"{signature} {{", *(f"    {line}" for line in lines), "}", ""])


def _sum(column, bias, names):
    """Return the text of bias + sum of column times names; the shortest decimals that are exact in float32."""
    terms = [f"{weight!s} * {name}" for weight, name in zip(column, names, strict=True) if name]
    return " + ".join([str(np.float32(bias)), *terms])
