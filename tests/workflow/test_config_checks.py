"""What a dry run says of a configuration that its schema accepts."""

import copy
import subprocess

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from runner import ROOT, SMOKE, command, run

from neumat.augment.manifest import draw_manifest, protocol_indices
from neumat.config import load, source_names
from neumat.config_checks import check, check_sides, chosen_folds, folder_contents, smaller_sets
from neumat.errors import NeumatError

SCHEMA = ROOT / "workflow/schemas/config.schema.json"
DEFAULT = load({}, SCHEMA)
NAMES = source_names(DEFAULT["sources"])
SCENES = (ROOT / "config/scenes", ROOT / "workflow/schemas/scene.schema.json")


def checked(overlay, names=NAMES, scenes=SCENES[0]):
    config = copy.deepcopy(DEFAULT)
    for section, keys in overlay.items():
        config[section] |= keys
    check(load(config, SCHEMA), names, scenes, SCENES[1])


@pytest.mark.parametrize("overlay", ["config.yaml", "smoke.yaml", "paper.yaml"])
def test_shipped_configurations_pass(overlay):
    config = load(yaml.safe_load((ROOT / "config" / overlay).read_text()), SCHEMA)
    check(config, source_names(config["sources"]), *SCENES)


@pytest.mark.parametrize(
    ("overlay", "words"),
    [
        ({"augment": {"weight_range": [0.7, 0.3]}}, ["augment.weight_range", "ascending", "[0.7, 0.3]"]),
        ({"augment": {"held_out": 0.999}}, ["augment.held_out", "2 of 100 sources", "0.999"]),
        ({"scenes": {"tolerance": 0.03}}, ["scenes.tolerance", "0.005, 0.01, 0.02, 0.04, 0.08", "0.03"]),
        ({"scenes": {"names": ["studio", "nowhere"]}}, ["scenes.names", "nowhere.yaml"]),
        ({"evaluate": {"set_size": 2281}}, ["evaluate.set_size", "at most 2280", "training", "parity", "2281"]),
        ({"augment": {"held_out": 0.97}}, ["evaluate.set_size", "at most 72", "training", "parity", "120"]),
        (
            {"augment": {"held_out": 0.0001}},
            ["augment.held_out", "at least 2 reference materials", "parity", "found 0"],
        ),
        ({"constrained": {"rules": DEFAULT["constrained"]["rules"] | {"specular": [600, 100]}}}, ["specular"]),
        (
            {"generative": {"methods": {"hyperdiffusion": {"sigma_min": 30.0}}}},
            ["hyperdiffusion.sigma_min and sigma_max", "[30.0, 20.0]"],
        ),
    ],
)
def test_a_mistake_is_named_in_one_line(overlay, words):
    with pytest.raises(NeumatError) as error:
        checked(overlay)
    assert len(str(error.value).splitlines()) == 1
    assert all(word in str(error.value) for word in words), error.value


def test_few_sources_have_few_folds():
    assert chosen_folds([0, 1, 2, 3, 4], 4) == [0, 1, 2, 3] and chosen_folds([4, 0], 100) == [4, 0]
    small = {"evaluate": {"set_size": 2, "folds": [4]}, "augment": {"blends": 4, "held_out": 0.3}}
    with pytest.raises(NeumatError, match=r"evaluate\.folds: expected a fold below 4, as many as 4 sources have"):
        checked(small, NAMES[:4])


@pytest.mark.parametrize(
    ("material", "good"),
    [
        ("chrome", True), ("chrome@rbg", True), ("blend-299", True), ("sample-1199", True), ("sources@1", True),
        ("samples@0.05", True), ("sources@0.5", True),
        ("chrom", False), ("blend-300", False), ("sample-1200", False), ("sources@1.5", False), ("sources@", False),
        ("chrome@rgb", False),
    ],
)  # fmt: skip
def test_materials_of_scenes_are_those_that_a_run_makes(tmp_path, material, good):
    camera, item = {"at": [0, 0, 1], "towards": [0, 0, 0]}, {"shape": "knot", "materials": [material]}
    layout = {"light": "sun", "camera": camera, "objects": {"a": item}}
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump(layout))
    if good:
        checked({"scenes": {"names": ["mine"]}}, scenes=tmp_path)
    else:
        with pytest.raises(NeumatError, match=r"mine\.yaml: key objects\.a\.materials: expected the name of a source"):
            checked({"scenes": {"names": ["mine"]}}, scenes=tmp_path)


@given(st.integers(4, 30), st.integers(0, 20), st.floats(0.01, 0.5), st.integers(2, 200))
def test_a_set_is_accepted_where_the_training_side_holds_it(n, blends, held_out, size):
    augment = {"blends": blends, "held_out": held_out, "weight_range": [0.3, 0.7]}
    manifest = draw_manifest([f"m{i}" for i in range(n)], augment, 0)
    evaluate = {"protocols": ["parity", "grouped"], "set_size": size}
    sides = [protocol_indices(manifest, protocol) for protocol in evaluate["protocols"]]
    if all(len(train) >= size and len(reference) >= 2 for train, reference in sides):
        check_sides(manifest, evaluate)
    else:
        with pytest.raises(NeumatError):
            check_sides(manifest, evaluate)


def test_smaller_sets_are_said_for_each_protocol():
    assert smaller_sets(DEFAULT, NAMES) == ""
    few = smaller_sets(DEFAULT, NAMES[:20])  # (20 + 300) * 6 * .05 references, 4 sources a fold in 6 orders
    expected = {"parity": 96, "grouped": 102} | {f"fold{k}": 24 for k in range(5)}
    assert few.endswith(", ".join(f"{name} {count}" for name, count in expected.items()) + "\n")


def test_a_dry_run_says_smaller_sets_and_goes_on(tmp_path):
    (tmp_path / "mine.yaml").write_text("evaluate: {set_size: 20}")
    done = run(tmp_path, "--dry-run", "--", "all", overlays=(SMOKE, tmp_path / "mine.yaml"))
    assert (done.stdout + done.stderr).count("not 20 but all references are compared of parity 12, ") == 1


def test_contents_of_a_folder(tmp_path):
    assert folder_contents("conditional.measured", None) == []
    with pytest.raises(NeumatError, match=r"conditional\.measured: expected a folder of \.bsdf files; found .*none in"):
        folder_contents("conditional.measured", tmp_path)
    with pytest.raises(NeumatError, match=r"conditional\.measured: expected a folder of \.bsdf files; found .*absent"):
        folder_contents("conditional.measured", tmp_path / "absent")
    for name in ("b.bsdf", "A.BSDF", ".hidden.bsdf", "notes.txt"):
        (tmp_path / name).touch()
    assert folder_contents("conditional.measured", tmp_path) == [str(tmp_path / name) for name in ("A.BSDF", "b.bsdf")]


def refusal(folder, text):
    """Return the lines that a dry run of the smoke configuration with `text` over it says; it must fail."""
    (folder / "mine.yaml").write_text(text)
    line = command(folder, "--dry-run", "--", "all", overlays=(SMOKE, folder / "mine.yaml"))
    done = subprocess.run(line, capture_output=True, text=True)
    assert done.returncode != 0
    return [line for line in done.stderr.splitlines() if not line.startswith("Using workflow specific profile")]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("conditional: {measured: absent}", "config key conditional.measured: expected a folder of .bsdf files"),
        ("evaluate: {set_size: 500}", "config key evaluate.set_size: expected at most 48, the training materials"),
        ("sources: {folder: here}", "config key sources.kind: expected merl or rgl"),
    ],
)
def test_a_dry_run_ends_in_that_line(tmp_path, text, words):
    said = refusal(tmp_path, text)
    assert len(said) == 1 and said[0].startswith(words), said


@pytest.mark.parametrize("name", ["Sample-0", "a\nb"])
def test_a_dry_run_names_the_file_to_rename(tmp_path, name):
    (tmp_path / "measured").mkdir()
    for stem in ("001", "NA", "steel", "nan", name):
        (tmp_path / "measured" / f"{stem}.binary").touch()
    said = refusal(tmp_path, f"sources: {{kind: merl, folder: {tmp_path / 'measured'}}}")
    assert len(said) == 1 and "rename" in said[0] and ascii(f"{name}.binary")[1:-1] in said[0], said


def test_a_changed_measured_file_is_an_input(tmp_path):
    (tmp_path / "rgl").mkdir()
    (tmp_path / "rgl/paper.bsdf").touch()
    (tmp_path / "mine.yaml").write_text("conditional: {measured: rgl}")
    done = run(tmp_path, "--dry-run", "--", "conditional", overlays=(SMOKE, tmp_path / "mine.yaml"))
    assert "rgl/paper.bsdf" in done.stdout + done.stderr
