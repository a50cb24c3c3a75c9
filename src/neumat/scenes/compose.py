"""From a layout in the config to a scene of Mitsuba.

A layout has `light` (a name in LIGHTS), `exposure`, `camera` (`at`, `towards`: points; `fov`: degrees, across) and
`objects` {name: object}. An object has `shape`, `at` [x, z] on the floor, `size`, `turn` (degrees about the vertical)
and `materials`: the first, and more that lie over it where a texture of `masks` shows them, a mask to each; it may have
a `bump` or `normals` texture. A material is a name, or the Mitsuba dictionary of an endless BTF. `repeat` says how
often textures repeat across it, `depth` how deep bumps are.

World frame: y is up, the floor is y = 0.
"""

import math
from dataclasses import dataclass

import numpy as np

from neumat.errors import NeumatError
from neumat.render.mitsuba_scene import mitsuba
from neumat.scenes.shapes import OPEN, mesh
from neumat.scenes.textures import HEIGHTS, MASKS, normal_map, texture

BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
MAX_DEPTH = 5


@dataclass(frozen=True)
class Composition:
    """scene: the mi.Scene; meshes: {object: mi.Mesh}; width and height in pixels."""

    scene: object
    meshes: dict
    width: int
    height: int


def units(layout):
    """Return the materials of a layout, {(object, k): name}: the unit of choice is one material of one object. BTFs,
    of which there is no choice, are left out."""
    return {
        (name, k): material
        for name, item in layout["objects"].items()
        for k, material in enumerate(item["materials"])
        if isinstance(material, str)
    }


def compose(layout, bsdfs, width, height):
    """Return the Composition of a layout whose materials look like `bsdfs`, {unit: Mitsuba dictionary}.

    Raises NeumatError for a shape, texture or light that does not exist, and a bad file or property of a BSDF of ours.
    """
    mi = mitsuba()
    from neumat.mitsuba import load_dict

    meshes = {}
    for name, item in layout["objects"].items():
        parts = [bsdfs.get((name, k), material) for k, material in enumerate(item["materials"])]
        meshes[name] = _placed(mi, name, item)
        meshes[name].set_bsdf(load_dict(surface(item, parts)))
    view = layout["camera"]
    camera = {
        "type": "perspective",
        "fov": view["fov"],
        "to_world": mi.ScalarTransform4f().look_at(view["at"], view["towards"], [0, 1, 0]),
        "sampler": {"type": "multijitter"},
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
    }
    if layout["light"] not in LIGHTS:
        raise NeumatError("light", f"one of {', '.join(LIGHTS)}", repr(layout["light"]))
    # Loaded one by one: loaded with the scene, their order changes from run to run, and with it which one a random
    # number chooses.
    lights = {name: load_dict(light) for name, light in LIGHTS[layout["light"]](mi).items()}
    integrator = {"type": "path", "max_depth": MAX_DEPTH, "rr_depth": MAX_DEPTH + 1}
    loaded = load_dict({"type": "scene", "integrator": integrator, "sensor": camera, **lights, **meshes})
    return Composition(loaded, meshes, width, height)


def surface(item, parts):
    """Return the Mitsuba dictionary of an object's surface, whose materials are the dictionaries `parts`."""
    mi = mitsuba()

    def bitmap(image):
        scale = mi.ScalarTransform4f().scale([item["repeat"], item["repeat"], 1])
        return {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True, "to_uv": scale}

    inside, *more = parts
    for name, part in zip(item["masks"], more, strict=True):
        mask = bitmap(texture(MASKS, name)[..., None])
        inside = {"type": "blendbsdf", "weight": mask, "a": inside, "b": part}
    if item["normals"]:
        normals = bitmap(normal_map(texture(HEIGHTS, item["normals"])))
        inside = {"type": "normalmap", "normalmap": normals, "inside": inside}
    if item["bump"]:
        height = bitmap(texture(HEIGHTS, item["bump"])[..., None])
        inside = {"type": "bumpmap", "map": height, "scale": item["depth"], "inside": inside}
    return {"type": "twosided", "inside": inside} if item["shape"] in OPEN else inside


def _placed(mi, name, item):
    """Return the mi.Mesh of an object where it stands."""
    made = mesh(item["shape"])
    turn = math.radians(item["turn"])
    rotation = np.array([[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0, math.cos(turn)]])
    x, z = item["at"]
    vertices = item["size"] * made.vertices @ rotation.T + np.array([x, 0, z])
    placed = mi.Mesh(name, len(vertices), len(made.faces), has_vertex_normals=True, has_vertex_texcoords=True)
    parameters = mi.traverse(placed)
    for key, values in (
        ("vertex_positions", vertices),
        ("vertex_normals", made.normals @ rotation.T),
        ("vertex_texcoords", made.uv),
        ("faces", made.faces),
    ):
        kind = np.uint32 if key == "faces" else np.float32
        parameters[key] = type(parameters[key])(np.ascontiguousarray(values, kind).ravel())
    parameters.update()
    return placed


def _sun(mi):
    """Mitsuba's sun and sky, late in the morning, from the front left."""
    upright = mi.ScalarTransform4f().rotate([1, 0, 0], -90)
    return {
        "sky": {
            "type": "sunsky",
            "sun_direction": [-0.55, 0.62, 0.56],
            "turbidity": 3.0,
            "to_world": upright,
        }
    }


def _studio(mi):
    """Area lights: a large key light, a strip, a light from behind; a dim room around."""

    def softbox(at, width, height, radiance):
        facing = mi.ScalarTransform4f().look_at(at, [0, 0.9, 0], [0, 1, 0])
        size = mi.ScalarTransform4f().scale([width / 2, height / 2, 1])
        light = {"type": "area", "radiance": {"type": "rgb", "value": radiance}}
        return {"type": "rectangle", "to_world": facing @ size, "emitter": light, "bsdf": BLACK}

    return {
        "key": softbox([-4.5, 5.0, 4.0], 3.0, 3.0, 9.0),
        "strip": softbox([5.0, 2.5, 2.5], 0.8, 4.0, 7.0),
        "rim": softbox([1.5, 5.0, -5.0], 4.0, 1.5, 8.0),
        "room": {"type": "constant", "radiance": {"type": "rgb", "value": 0.25}},
    }


LIGHTS = {"sun": _sun, "studio": _studio}
