import os

import numpy as np
import pytest
import torch

from neumat.errors import NeumatError
from neumat.export import export
from neumat.fields.layout import SIZE, size
from neumat.render.mitsuba_scene import bsdf, mitsuba

GLOSSY = {"type": "glossy", "parameters": "0.2 0.1 0.1 0.04 0.04 0.04 0.2"}
SCENE = """
<scene version="3.0.0"><shape type="sphere"><bsdf type="twosided">
<bsdf type="nbrdf"><string name="filename" value="materials/a.safetensors"/></bsdf>
</bsdf></shape></scene>
"""


@pytest.fixture
def mi():
    """Mitsuba in its scalar variant, with its search path as it was afterwards."""
    module = mitsuba()
    best, resolver = module.variant(), module.file_resolver()
    paths = list(resolver)
    module.set_variant("scalar_rgb")
    yield module
    resolver.clear()
    for path in paths:
        resolver.append(path)
    module.set_variant(best)


def load(plugin):
    from neumat.mitsuba import load_dict

    return load_dict(plugin)


def overhead(mi, plugin):
    """Return f cos for a light and a view along the normal."""
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(0, 0, 1)
    return np.array(plugin.eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1)))


def test_files_are_found_beside_the_scene_and_on_mitsubas_search_path(mi, field, tmp_path, monkeypatch):
    materials = tmp_path / "scene" / "materials"
    bright, dark = (export(field(albedo), "safetensors", materials, name) for albedo, name in ((0.8, "a"), (0.2, "b")))
    scene = tmp_path / "scene" / "scene.xml"
    scene.write_text(SCENE)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    mi.load_file(str(scene))
    with pytest.raises(NeumatError, match="no such file"):
        load({"type": "nbrdf", "filename": "b.safetensors"})
    mi.file_resolver().append(str(materials))
    found = overhead(mi, load({"type": "nbrdf", "filename": "b.safetensors"}))
    assert np.allclose(found, 0.2 / np.pi, rtol=1e-3)
    for path in (bright, os.path.relpath(bright)):
        assert np.allclose(overhead(mi, load({"type": "nbrdf", "filename": str(path)})), 0.8 / np.pi, rtol=1e-3)
    assert dark.exists()


def test_a_store_and_a_table_are_found_on_the_search_path(mi, tmp_path):
    mi.file_resolver().append(str(tmp_path))
    for plugin, name in (({"material": "chrome"}, "store.h5"), ({}, "table.binary")):
        (tmp_path / name).write_bytes(b"nothing of ours")
        kind = "nbrdf" if plugin else "merl"
        with pytest.raises(NeumatError, match=str(tmp_path / name)):
            load({"type": kind, "filename": name, **plugin})


@pytest.mark.parametrize(("value", "conserves"), [
    (True, True), ("true", True), ("True", True), (" TRUE ", True), (False, False), ("false", False), ("False", False),
])  # fmt: skip
def test_conserve_may_be_a_text(mi, field, value, conserves):
    found = overhead(mi, load(bsdf(field(2.0)) | {"conserve": value}))
    assert np.allclose(found, (1.0 if conserves else 2.0) / np.pi, rtol=0.02)


def test_conserve_as_xml_writes_it(mi, field):
    weights = bsdf(field(2.0))["weights"]
    for element in ("boolean", "string"):
        loaded = mi.load_string(
            f'<bsdf version="3.0.0" type="nbrdf"><string name="weights" value="{weights}"/>'
            f'<{element} name="conserve" value="false"/></bsdf>'
        )
        assert np.allclose(overhead(mi, loaded), 2 / np.pi, rtol=0.02)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"conserve": "yes"}, "glossy: conserve: expected true or false; found 'yes'"),
        ({"conserve": 1}, "true or false; found 1"),
        ({"conserve": 0.5}, "true or false"),
        ({"parameters": 0.5}, "glossy: parameters: expected a text; found 0.5"),
        ({"parameters": True}, "glossy: parameters: expected a text"),
        ({"sampler": 3}, "sampler: expected one of"),
        ({"lobes": 1.0}, "glossy: lobes: expected a text"),
        ({"sampler": True}, "sampler: expected one of"),
        ({"type": "nbrdf", "parameters": None, "filename": 3}, "nbrdf: filename: expected a text; found 3"),
        ({"type": "merl", "parameters": None, "filename": 2.5}, "merl: filename: expected a text"),
        ({"type": "nbrdf", "parameters": None, "filename": "a.h5", "material": 1}, "nbrdf: material: expected a text"),
        ({"type": "nbrdf", "parameters": None, "weights": 1.0}, "nbrdf: weights: expected a text"),
        ({"type": "nbrdf", "parameters": None, "weights": "1", "filename": "a.npy"}, "filename or weights; found both"),
    ],
)
def test_properties_of_the_wrong_type_end_in_one_line(mi, change, words):
    plugin = {key: value for key, value in (GLOSSY | change).items() if value is not None}
    with pytest.raises(NeumatError, match=words) as caught:
        load(plugin)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("count", [0, 1, 3, SIZE - 1, SIZE + 1, size((6, 4, 4, 3))])
@pytest.mark.parametrize("name", ["scalar_rgb", "best"])
def test_an_update_with_another_number_of_weights_leaves_the_material_as_it_was(mi, field, count, name):
    if name == "best":
        mi.set_variant(mitsuba().variant())
    plugin = load(bsdf(field(0.5)))
    parameters = mi.traverse(plugin)
    array = type(parameters["weights"])
    for wrong in (np.zeros(count, np.float32), np.full(SIZE, np.nan, np.float32)):
        # In scalar variants Mitsuba itself refuses another size (but 1) when it is set.
        with pytest.raises((NeumatError, RuntimeError), match=f"{SIZE} finite numbers|incompatible input") as caught:
            parameters["weights"] = array(wrong)
            parameters.update()
        assert "\n" not in str(caught.value)
        assert np.allclose(overhead_of(mi, plugin), 0.5 / np.pi, rtol=1e-3)
    parameters["weights"] = array(field(0.25).numpy())
    parameters.update()
    assert np.allclose(overhead_of(mi, plugin), 0.25 / np.pi, rtol=1e-3)


def overhead_of(mi, plugin):
    import drjit as dr

    if not dr.is_jit_v(mi.Float):
        return overhead(mi, plugin)
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(0, 0, 1)
    return plugin.eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1)).numpy()


@pytest.mark.parametrize("name", ["scalar_spectral", "scalar_spectral_polarized", "llvm_ad_mono"])
def test_variants_that_are_not_served_say_which_are(mi, name):
    try:
        mi.set_variant(name)
    except ImportError:
        pytest.skip(f"Mitsuba has no {name} here")
    for plugin in (GLOSSY, bsdf(torch.zeros(SIZE)), {"type": "merl", "filename": "a.binary"}):
        with pytest.raises(NeumatError, match=f"{plugin['type']}: expected an RGB variant .*scalar_rgb.*found {name}"):
            load({"type": "twosided", "a": plugin})
    mi.set_variant("scalar_rgb")
    load(GLOSSY)
