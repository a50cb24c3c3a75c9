"""Mitsuba 3 pictures: the reference that the sphere renderer is checked against, and the grids shown to people.

Mitsuba is imported on first use: which variant works depends on the LLVM library that Dr.Jit loads at import.
"""

import ctypes.util
import functools
import importlib.metadata
import math
import os
import subprocess
import sys

import numpy as np
import torch

from neumat.fields.layout import unpack
from neumat.render import scene

LOBES = (0.2, 0.05, 0.01, 0.003)  # roughness of the GGX lobes that are sampled beside the cosine lobe
ENVMAP_HEIGHT = 512
TINY = 1e-7  # in scalar variants both branches of a select run, so no branch may divide by 0
SHEET_BACKGROUND = 0.6  # linear radiance between the spheres of a contact sheet
# Of the contact sheets' studio: direction, half width and half height (of the unit sphere's radius), radiance.
SOFTBOXES = (
    ((-0.6, 0.65, 0.6), 0.30, 0.42, 7.0),
    ((0.85, 0.3, 0.35), 0.16, 0.6, 3.5),
    ((-0.9, 0.1, -0.5), 0.2, 0.7, 4.0),
)
# Some LLVM versions abort the process at the first render, so each library is first tried in another process.
PROBE = (
    "import mitsuba as mi; mi.set_variant('llvm_ad_rgb');"
    "print(mi.render(mi.load_dict({'type': 'scene', 's': {'type': 'sphere'}, 'e': {'type': 'constant'},"
    "'i': {'type': 'path'}, 'c': {'type': 'perspective', 'f': {'type': 'hdrfilm', 'width': 4, 'height': 4}}}), spp=1))"
)


def _llvm_libraries():
    """Yield candidate paths of LLVM's shared library: the user's choice, the Python package, the system's."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        yield os.environ["DRJIT_LIBLLVM_PATH"]
    try:
        files = importlib.metadata.files("karellen-llvm-core") or []
        yield from (str(file.locate().resolve()) for file in files if file.name == "libLLVM.so")
    except importlib.metadata.PackageNotFoundError:
        pass
    yield from filter(None, (ctypes.util.find_library(f"LLVM-{version}") for version in range(23, 16, -1)))


@functools.cache
def variant():
    """Return the Mitsuba variant in use, after a trial in another process: "llvm_ad_rgb", else "scalar_rgb"."""
    for path in _llvm_libraries():
        environment = {**os.environ, "DRJIT_LIBLLVM_PATH": path}
        if subprocess.run([sys.executable, "-c", PROBE], env=environment, capture_output=True).returncode == 0:
            os.environ["DRJIT_LIBLLVM_PATH"] = path
            return "llvm_ad_rgb"
    return "scalar_rgb"


@functools.cache
def mitsuba(name=None):
    """Return the mitsuba module, with `name` or the best variant set and the BSDF "neural_field" registered."""
    name = name or variant()
    import mitsuba as mi

    mi.set_variant(name)
    mi.register_bsdf("neural_field", _neural_field(mi))
    return mi


def _neural_field(mi):
    """Return the class of a BSDF with the field of 675 weights, for the variant that is set."""
    import drjit as dr

    class NeuralField(mi.BSDF):
        """Reflection by a neural field; the property `weights` is a text of 675 numbers.

        Directions are drawn from an even mixture of the cosine lobe and GGX lobes of fixed roughness.
        """

        def __init__(self, properties):
            mi.BSDF.__init__(self, properties)
            weights = torch.tensor([float(w) for w in properties["weights"].split()])
            # Plain numbers become constants of the kernel: its compilation costs less than reading them from memory.
            self.layers = [(kernel.T.tolist(), bias.tolist()) for kernel, bias in unpack(weights)]
            self.lobes = [mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, True) for alpha in LOBES]
            self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]

        def value(self, wi, wo):
            """Return f cos(theta_o), with half and difference vectors as in neumat.brdf.coordinates."""
            h = dr.normalize(wi + wo)
            sin_h = dr.sqrt(h.x * h.x + h.y * h.y)
            safe = sin_h > TINY
            cos_p = dr.select(safe, h.x / dr.maximum(sin_h, TINY), 1)
            sin_p = dr.select(safe, h.y / dr.maximum(sin_h, TINY), 0)
            x, y = cos_p * wo.x + sin_p * wo.y, cos_p * wo.y - sin_p * wo.x
            dx, dz = h.z * x - sin_h * wo.z, sin_h * x + h.z * wo.z
            sign = dr.select(y < 0, -1, 1)  # phi_d modulo pi
            values = [sin_h, 0.0, h.z, sign * dx, sign * y, dz]
            for depth, (kernel, bias) in enumerate(self.layers):
                values = [
                    sum((w * v for w, v in zip(row, values, strict=True)), b)
                    for row, b in zip(kernel, bias, strict=True)
                ]
                if depth < len(self.layers) - 1:
                    values = [dr.maximum(v, 0) for v in values]
            values = [dr.maximum(dr.exp(v) - 1, 0) for v in values]
            return mi.Color3f(*values) * wo.z

        def density(self, wi, wo):
            h = dr.normalize(wi + wo)
            total = wo.z / math.pi
            for lobe in self.lobes:
                total += lobe.pdf(wi, h) / (4 * dr.maximum(dr.dot(wo, h), TINY))
            return total / (1 + len(self.lobes))

        def sample(self, ctx, si, sample1, sample2, active=True):
            wo = mi.warp.square_to_cosine_hemisphere(sample2)
            for i, lobe in enumerate(self.lobes):
                m, _ = lobe.sample(si.wi, sample2)
                chosen = sample1 * (1 + len(self.lobes)) >= i + 1
                wo = dr.select(chosen, mi.reflect(si.wi, m), wo)
            active = active & (si.wi.z > 0) & (wo.z > 0)
            bs = mi.BSDFSample3f()
            bs.wo, bs.eta, bs.sampled_component = wo, 1.0, 0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            bs.pdf = dr.select(active, self.density(si.wi, wo), 0)
            active &= bs.pdf > 0
            return bs, dr.select(active, self.value(si.wi, wo) / dr.maximum(bs.pdf, TINY), 0)

        def eval(self, ctx, si, wo, active=True):
            return dr.select(active & (si.wi.z > 0) & (wo.z > 0), self.value(si.wi, wo), 0)

        def pdf(self, ctx, si, wo, active=True):
            return dr.select(active & (si.wi.z > 0) & (wo.z > 0), self.density(si.wi, wo), 0)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def to_string(self):
            return "NeuralField[]"

    return NeuralField


def bsdf(weights):
    """Return the Mitsuba dictionary of a neural field (675,)."""
    return {"type": "neural_field", "weights": " ".join(repr(float(w)) for w in weights)}


@functools.cache
def _envmap(environment):
    """Return the picture (h, 2h, 3), float32, of an analytic environment in Mitsuba's latitude and longitude."""
    height = ENVMAP_HEIGHT
    v = (torch.arange(height, dtype=torch.float64) + 0.5) / height * math.pi
    u = (torch.arange(2 * height, dtype=torch.float64) + 0.5) / height * math.pi
    v, u = torch.meshgrid(v, u, indexing="ij")
    directions = torch.stack([v.sin() * u.sin(), v.cos(), -v.sin() * u.cos()], -1)
    return environment(directions).float()[..., None].expand(-1, -1, 3).numpy().copy()


def render_mitsuba(weights, size, spp, environment=scene.environment, background=scene.BACKGROUND, seed=0):
    """Return the linear picture (size, size, 3), float32, of a field (675,) in the scene of `scene.py`."""
    return render_bsdf(bsdf(weights), size, spp, environment, background, seed)


def render_bsdf(material, size, spp, environment=scene.environment, background=scene.BACKGROUND, seed=0):
    """Return the linear picture (size, size, 3), float32, of any Mitsuba BSDF dictionary in the scene."""
    mi = mitsuba()
    camera = mi.ScalarTransform4f().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0])
    loaded = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2, "hide_emitters": True},
            "sensor": {
                "type": "orthographic",
                "to_world": camera @ mi.ScalarTransform4f().scale([1 / scene.RADIUS, 1 / scene.RADIUS, 1]),
                "sampler": {"type": "multijitter"},
                "film": {
                    "type": "hdrfilm",
                    "width": size,
                    "height": size,
                    "pixel_format": "rgba",
                    "component_format": "float32",
                    "rfilter": {"type": "box"},
                },
            },
            "sphere": {"type": "sphere", "material": material},
            "light": {"type": "envmap", "bitmap": mi.Bitmap(_envmap(environment))},
        }
    )
    rgba = np.array(mi.render(loaded, spp=spp, seed=seed))
    return rgba[..., :3] + background * (1 - rgba[..., 3:])


def studio(directions):
    """Return the radiance (...) of the photo studio of the contact sheets: softboxes, ceiling, floor; achromatic."""
    y = directions[..., 1]
    total = 0.45 + 0.15 * y + 0.12 * torch.tanh(12 * y)
    for direction, width, height, radiance in SOFTBOXES:
        axis = torch.nn.functional.normalize(directions.new_tensor(direction), dim=0)
        side = torch.nn.functional.normalize(torch.linalg.cross(directions.new_tensor([0.0, 1.0, 0.0]), axis), dim=0)
        across, along, front = directions @ side, directions @ torch.linalg.cross(axis, side), directions @ axis
        inside = torch.sigmoid(60 * (width - across.abs())) * torch.sigmoid(60 * (height - along.abs()))
        total = total + radiance * inside * (front > 0)
    return total


def render_grid(weights, columns, size, spp):
    """Return a contact sheet, uint8 sRGB (rows * size, columns * size, 3), of fields (n, 675), row by row."""
    tiles = [render_mitsuba(w, size, spp, studio, SHEET_BACKGROUND, seed) for seed, w in enumerate(weights)]
    rows = math.ceil(len(tiles) / columns)
    sheet = np.full((rows * columns, size, size, 3), SHEET_BACKGROUND, np.float32)
    sheet[: len(tiles)] = tiles
    sheet = sheet.reshape(rows, columns, size, size, 3).swapaxes(1, 2).reshape(rows * size, columns * size, 3)
    return scene.to_srgb8(torch.from_numpy(sheet), 1.0).numpy()
