"""The configuration: one-line errors, and schema, defaults and documentation that agree."""

import json
import re
import subprocess
from dataclasses import fields

import pytest
import yaml
from runner import ROOT, command

from neumat.brdf.embedded import embedded_names
from neumat.brdf.published import merl_checksums
from neumat.btf.representations.registry import REPRESENTATIONS
from neumat.btf.synthesis import SYNTHESES
from neumat.config import keys, load, load_scene, source_files, source_names, table
from neumat.errors import NeumatError
from neumat.generative.registry import METHODS
from neumat.scenes.compose import LIGHTS
from neumat.scenes.shapes import SHAPES
from neumat.scenes.textures import HEIGHTS, MASKS

SCHEMA = ROOT / "workflow/schemas/config.schema.json"
SCHEMA_TREE = json.loads(SCHEMA.read_text())
DEFAULT = yaml.safe_load((ROOT / "config/config.yaml").read_text())


def sections(schema, name="config"):
    if "properties" in schema:
        yield name, schema
        for key, child in schema["properties"].items():
            yield from sections(child, key)


def test_default_config_is_what_the_schema_fills_in():
    assert load({}, SCHEMA) == DEFAULT == load(DEFAULT, SCHEMA)


@pytest.mark.parametrize("overlay", sorted((ROOT / "config").glob("*.yaml")), ids=lambda path: path.name)
def test_overlays_are_valid(overlay):
    load(yaml.safe_load(overlay.read_text()), SCHEMA)


SCENES = sorted((ROOT / "config/scenes").glob("*.yaml"))
SCENE_SCHEMA = ROOT / "workflow/schemas/scene.schema.json"


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.name)
def test_scenes_are_valid_and_filled_in(path):
    layout = load_scene(path, SCENE_SCHEMA)
    assert all(item["bump"] in (None, *HEIGHTS) and len(item["at"]) == 2 for item in layout["objects"].values())


def test_names_of_representations_and_syntheses_are_those_of_the_code():
    btf = SCHEMA_TREE["properties"]["btf"]["properties"]
    synthesis = btf["synthesis"]["properties"]
    assert btf["compared"]["items"]["enum"] == btf["representations"]["propertyNames"]["enum"]
    assert set(btf["compared"]["items"]["enum"]) == set(REPRESENTATIONS)
    for key in (synthesis["methods"]["items"], synthesis["stochastic"], synthesis["structured"]):
        assert set(key["enum"]) == set(SYNTHESES)


def test_names_of_shapes_textures_and_lights_are_those_of_the_code():
    scene = json.loads(SCENE_SCHEMA.read_text())["properties"]
    item = scene["objects"]["additionalProperties"]["properties"]
    assert scene["light"]["enum"] == list(LIGHTS)
    assert item["shape"]["enum"] == list(SHAPES)
    assert item["masks"]["items"]["enum"] == list(MASKS)
    assert item["bump"]["enum"] == item["normals"]["enum"] == [None, *HEIGHTS]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("light: [", "a scene's YAML file"),
        ("[" * 5000, "too deep to read"),
        ("light: sun", "camera: expected the key at"),
        (
            "{light: moon, camera: {at: [0, 0, 1], towards: [0, 0, 0]}, objects: {a: {shape: knot, materials: [x]}}}",
            "moon",
        ),
        ("{light: sun, camera: {at: [0, 0, 1], towards: [0, 0, 0]}, objects: {a: {shape: knot, hue: 1}}}", "hue"),
        (
            "{light: sun, camera: {at: [0, 0, 1], towards: [0, 0, 0]}, objects: {a: {shape: knot, materials: [x, y]}}}",
            "objects.a.masks: expected 1, one less than materials; found 0",
        ),
        (
            "{light: sun, camera: {at: [0, 0], towards: [0, 0, 0]}, objects: {a: {shape: knot, materials: [x]}}}",
            "camera.at",
        ),
        ("{light: sun, camera: {at: [0, 0, 1], towards: [0, 0, 0]}, objects: {a: {shape: knot}}}", "the key materials"),
    ],
)
def test_a_wrong_scene_ends_in_one_line(tmp_path, text, words):
    (tmp_path / "mine.yaml").write_text(text)
    with pytest.raises(NeumatError) as caught:
        load_scene(tmp_path / "mine.yaml", SCENE_SCHEMA)
    message = str(caught.value)
    assert words in message and "mine.yaml" in message and "\n" not in message


def test_a_missing_scene_ends_in_one_line(tmp_path):
    line = command(tmp_path, "--dry-run", "--", "results/scenes/nowhere.png")
    done = subprocess.run(line, capture_output=True, text=True)
    assert done.returncode != 0 and "nowhere.yaml" in done.stdout + done.stderr


def test_no_section_takes_unknown_keys():
    assert all(schema["additionalProperties"] is False for _, schema in sections(SCHEMA_TREE))


def test_every_key_says_what_it_means_and_what_it_allows():
    for name, schema in keys(SCHEMA_TREE):
        assert schema["description"].endswith("."), name
        assert "default" in schema and ("type" in schema or "enum" in schema), name


def test_readme_table_is_up_to_date():
    assert (ROOT / "config/README.md").read_text() == table(SCHEMA_TREE)


@pytest.mark.parametrize("method", METHODS)
def test_hyperparameters_of_a_method_are_those_of_its_class(method):
    known = SCHEMA_TREE["properties"]["generative"]["properties"]["methods"]["properties"][method]["properties"]
    own = {field.name for field in fields(METHODS[method])} - {"sampler", "nfe"}
    # MERL100 has those of hyperdiffusion, so that nothing but the training data differs.
    assert set(known) == (set() if method == "merl100" else own)


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"fitt": {}}, ["fitt", "unknown key"]),
        ({"fit": {"bach": 3}}, ["fit.bach", "unknown key"]),
        ({"fit": {"batch_size": -1}}, ["fit.batch_size", ">= 1", "-1"]),
        ({"fit": {"batch_size": "many"}}, ["fit.batch_size", "integer", "many"]),
        ({"fit": {"learning_rate": float("nan")}}, ["fit.learning_rate", "number", "nan"]),
        ({"fit": 3}, ["config key fit:", "a section", "3"]),
        ({"sources": {"kind": "mrl"}}, ["sources.kind", '"merl"', "'mrl'"]),
        ({"evaluate": {"methods": ["pca"]}}, ["evaluate.methods.0", "hyperdiffusion", "'pca'"]),
    ],
)
def test_a_wrong_value_is_named_in_one_line(config, words):
    with pytest.raises(NeumatError) as error:
        load(config, SCHEMA)
    assert "\n" not in str(error.value)
    assert all(word in str(error.value) for word in words)


def test_an_empty_section_means_its_defaults():
    assert load({"fit": None}, SCHEMA)["fit"] == DEFAULT["fit"]


def test_keys_come_in_one_order_whatever_an_overlay_names_first():
    config = load({"fit": {"samples": 10000, "batch_size": 64}, "seed": 3}, SCHEMA)
    assert list(config) == list(DEFAULT) and list(config["fit"]) == list(DEFAULT["fit"])


def test_sources_of_the_users_own(tmp_path):
    sources = DEFAULT["sources"] | {"kind": "merl", "folder": str(tmp_path)}
    with pytest.raises(NeumatError, match=r"\.binary files; found an empty folder"):
        source_names(sources)
    for name in ("b", "NA", "c", "001", ".hidden"):
        (tmp_path / f"{name}.binary").touch()
    assert source_files(sources) == {name: tmp_path / f"{name}.binary" for name in ("001", "NA", "b", "c")}
    assert source_names(sources) == ["001", "NA", "b", "c"]
    assert source_names(sources | {"names": ["c", "001", "b", "NA"]}) == ["c", "001", "b", "NA"]
    with pytest.raises(NeumatError, match=r"sources\.names.*'d'"):
        source_names(sources | {"names": ["b", "d", "c", "NA"]})
    (tmp_path / "c.binary").unlink()
    with pytest.raises(NeumatError, match=r"at least 4 materials to split and blend; found 3"):
        source_names(sources)
    for wrong in (
        {"kind": "embedded"},
        {"kind": "rgl", "url": "http://127.0.0.1/{name}"},
        {"url": "http://127.0.0.1/a"},
    ):
        with pytest.raises(NeumatError, match=r"config key sources\.(kind|url)"):
            source_names(sources | wrong)
    with pytest.raises(NeumatError, match=r"sources\.folder"):
        source_names(sources | {"folder": str(tmp_path / "absent")})
    assert len(source_names(sources | {"url": "http://127.0.0.1/{name}.binary"})) == 100


def test_names_of_embedded_and_downloaded_sources_are_those_of_the_store():
    assert source_names(DEFAULT["sources"]) == embedded_names()
    urls = DEFAULT["sources"] | {"kind": "merl", "url": "http://127.0.0.1/{name}.binary", "folder": "."}
    assert source_names(urls) == list(merl_checksums())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fit: {bach: 3}", "config key fit.bach: expected one of"),
        ("fit: {batch_size: 0}", "config key fit.batch_size: expected integer >= 1; found 0"),
        ("sources: {kind: merl, folder: absent}", "config key sources.folder: expected a folder"),
        ("evaluate: {inception: absent.pth}", "config key evaluate.inception: expected a file; found absent.pth"),
    ],
)
def test_snakemake_ends_in_that_line(tmp_path, text, words):
    (tmp_path / "mine.yaml").write_text(text)
    run = subprocess.run(
        command(tmp_path, "--dry-run", overlays=[tmp_path / "mine.yaml"]), capture_output=True, text=True
    )
    assert run.returncode != 0
    said = [line for line in run.stderr.splitlines() if not line.startswith("Using workflow specific profile")]
    assert len(said) == 1 and re.match(re.escape(words), said[0]), run.stderr
