import numpy as np
import pytest

from neumat.errors import NeumatError
from neumat.render.mitsuba_scene import mitsuba
from neumat.scenes.compose import LIGHTS, compose, surface, units
from neumat.seeds import numpy_generator

compiled = pytest.mark.usefixtures("compiled")
WHITE = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}
PLAIN = {"shape": "sphere", "repeat": 1.0, "masks": [], "bump": None, "normals": None}


def picture(composition, spp, seed=0):
    return np.array(mitsuba().render(composition.scene, spp=spp, seed=seed))


def test_a_unit_is_one_material_of_one_object(layout):
    found = units(layout({"floor": ("plane", ["a"], {}), "ball": ("sphere", ["b", "a"], {"masks": ["spots"]})}))
    assert found == {("floor", 0): "a", ("ball", 0): "b", ("ball", 1): "a"}


@compiled
@pytest.mark.parametrize("light", LIGHTS)
def test_everything_at_once_has_finite_pixels(light, layout, grey, glossy):
    more = {"masks": ["veins"], "normals": "hammered", "bump": "weave", "depth": 0.02}
    both = layout({"floor": ("plane", ["a"], {}), "sheet": ("drape", ["a", "b"], more)}, light)
    bsdfs = {("floor", 0): WHITE, ("sheet", 0): glossy.plugin(None), ("sheet", 1): grey(0.5).plugin(None)}
    composition = compose(both, bsdfs, 8, 6)
    assert set(composition.meshes) == {"floor", "sheet"}
    found = picture(composition, 16)
    assert found.shape == (composition.height, composition.width, 3) == (6, 8, 3)
    assert np.isfinite(found).all() and found.min() >= 0 and found.mean() > 0.05


@compiled
def test_objects_stand_where_the_layout_says(layout):
    made = compose(
        layout({"sheet": ("drape", ["a"], {"at": [1.0, -2.0], "size": 2.0, "turn": 90.0})}), {("sheet", 0): WHITE}, 4, 3
    )
    box = made.meshes["sheet"].bbox()
    low, high = np.array(box.min), np.array(box.max)
    assert np.allclose(low[1], 0, atol=1e-5) and np.allclose(high[1], 4.4, atol=1e-5)
    assert np.allclose([low[2], high[2]], [-2 - 2.2, -2 + 2.2], atol=1e-4)  # its width now lies along z
    assert abs((low + high)[0] / 2 - 1) < 0.02 and (high - low)[0] < 1.2
    mi = mitsuba()
    # What looked towards z looks towards x after a quarter turn.
    si = made.scene.ray_intersect(mi.Ray3f(mi.Point3f(10, 2, -2.05), mi.Vector3f(-1, 0, 0)))
    assert si.is_valid()[0] and np.array(si.sh_frame.n)[0, 0] > 0.3


@compiled
@pytest.mark.parametrize("name", ["hammered", "weave"])
def test_bumps_and_normals_of_the_same_heights_tilt_the_same_way(name):
    """The normals are found from what a white surface reflects of light from four directions."""
    import drjit as dr

    mi = mitsuba()
    from neumat.render.mitsuba_bsdf import load_dict

    si = dr.zeros(mi.SurfaceInteraction3f, 2000)
    si.uv = mi.Point2f(numpy_generator(0, "uv").random((2, 2000), np.float32))
    si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
    si.sh_frame = mi.Frame3f(si.dp_du, si.dp_dv, mi.Vector3f(0, 0, 1))
    si.wi, si.n = mi.Vector3f(0, 0, 1), mi.Normal3f(0, 0, 1)
    slopes = []
    for item in ({"normals": name}, {"bump": name, "depth": 0.02}):
        loaded = load_dict(surface(PLAIN | item, [WHITE]))
        lit = [
            np.array(loaded.eval(mi.BSDFContext(), si, dr.normalize(mi.Vector3f(x, y, 1))))[0]
            for x, y in ((0.2, 0), (-0.2, 0), (0, 0.2), (0, -0.2))
        ]
        slopes.append((lit[0] - lit[1], lit[2] - lit[3]))
    for found, expected in zip(*slopes, strict=True):
        assert np.corrcoef(found, expected)[0, 1] > 0.5


@pytest.mark.parametrize(
    ("change", "bsdf", "words"),
    [
        ({"shape": "teapot"}, WHITE, "shape: expected one of plane"),
        ({"masks": ["tartan"]}, WHITE, "texture: expected one of checker"),
        ({"bump": "spots"}, WHITE, "texture: expected one of hammered"),
        ({"normals": "spots"}, WHITE, "texture: expected one of hammered"),
        ({}, {"type": "glossy", "parameters": "1 2 3"}, "glossy: parameters: expected 7 finite numbers"),
        ({}, {"type": "nbrdf"}, "filename or weights"),
        ({}, {"type": "nbrdf", "filename": "no/such.safetensors"}, "no such file"),
    ],
)
def test_a_bad_object_ends_in_one_line(change, bsdf, words, layout):
    bad = layout({"ball": ("sphere", ["a", "b"], {"masks": ["spots"], "depth": 0.1} | change)})
    bad["objects"]["ball"]["shape"] = change.get("shape", "plane")
    with pytest.raises(NeumatError, match=words) as caught:
        compose(bad, {("ball", 0): WHITE, ("ball", 1): bsdf}, 4, 3)
    assert "\n" not in str(caught.value)


def test_an_unknown_light_ends_in_one_line(layout):
    with pytest.raises(NeumatError, match="light: expected one of sun, studio; found 'moon'"):
        compose(layout({"floor": ("plane", ["a"], {})}, "moon"), {("floor", 0): WHITE}, 4, 3)


@compiled
def test_lights_keep_their_order(layout):
    """Which of them a random number chooses depends on it: the same seed must give the same picture."""
    composition = compose(layout({"floor": ("plane", ["a"], {})}), {("floor", 0): WHITE}, 4, 3)
    assert [shape.id() for shape in composition.scene.shapes()] == ["key", "strip", "rim", "floor"]


def test_open_shapes_show_their_back(layout):
    for name, kind in (("drape", "twosided"), ("sphere", "diffuse")):
        assert surface(layout({"a": (name, ["a"], {})})["objects"]["a"], [WHITE])["type"] == kind


@compiled
def test_a_white_room_keeps_its_light(layout, monkeypatch):
    """Nothing but a white ball in light that is the same everywhere: what is lost is what MAX_DEPTH ends."""
    monkeypatch.setitem(LIGHTS, "white", lambda mi: {"room": {"type": "constant", "radiance": 1.0}})
    found = picture(compose(layout({"ball": ("sphere", ["a"], {})}, "white"), {("ball", 0): WHITE}, 8, 6), 64)
    assert np.abs(found - 1).max() < 0.3 and abs(found.mean() - 1) < 0.01
