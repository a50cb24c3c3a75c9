"""Mitsuba 3 pictures: the reference that the sphere renderer is checked against, and the grids shown to people.

Mitsuba is imported on first use: which variant works depends on the LLVM library that Dr.Jit loads at import.
"""

import functools
import math

import numpy as np
import torch

from neumat.render import scene
from neumat.render.variant import variant

ENVMAP_HEIGHT = 512
SHEET_BACKGROUND = 0.6  # linear radiance between the spheres of a contact sheet
# Of the contact sheets' studio: direction, half width and half height (of the unit sphere's radius), radiance.
SOFTBOXES = (
    ((-0.6, 0.65, 0.6), 0.30, 0.42, 7.0),
    ((0.85, 0.3, 0.35), 0.16, 0.6, 3.5),
    ((-0.9, 0.1, -0.5), 0.2, 0.7, 4.0),
)


@functools.cache
def mitsuba():
    """Return the mitsuba module, with the best variant set and our BSDFs registered."""
    name = variant()
    import mitsuba as mi

    mi.set_variant(name)
    import neumat.render.mitsuba_bsdf  # noqa: F401

    return mi


def bsdf(weights):
    """Return the Mitsuba dictionary of a neural field (675,)."""
    return {"type": "nbrdf", "weights": " ".join(repr(float(w)) for w in weights)}


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
    return render_scene(sphere_scene(material, size, environment), spp, background, seed)


def sphere_scene(material, size, environment=scene.environment):
    """Return the mi.Scene of `scene.py` with a Mitsuba BSDF dictionary on the sphere; the picture has size^2 pixels.

    Raises NeumatError for a bad file or property of a BSDF of ours.
    """
    mi = mitsuba()
    from neumat.render.mitsuba_bsdf import load_dict

    camera = mi.ScalarTransform4f().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0])
    return load_dict(
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


def render_scene(loaded, spp, background=scene.BACKGROUND, seed=0):
    """Return the linear picture (size, size, 3), float32, of a `sphere_scene`."""
    rgba = np.array(mitsuba().render(loaded, spp=spp, seed=seed))
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
