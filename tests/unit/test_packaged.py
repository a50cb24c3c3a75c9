"""The model that comes with the package: in half precision, small, and in no table."""

import ast
import fnmatch
import tomllib
from pathlib import Path

import pandas as pd
import pytest
import torch

from neumat.conditions import packaged
from neumat.conditions.packaged import LARGEST, halved, packaged_model, write_packaged
from neumat.conditions.synthesis import Synthesiser
from neumat.errors import NeumatError
from neumat.fields.validity import valid
from neumat.generative.base import Dataset
from neumat.generative.conditional import ConditionalDiffusion, Tuning
from neumat.generative.registry import make
from neumat.metrics.appearance import appearance
from neumat.metrics.words import colour_right
from neumat.reporting.model_card import EMPTY, model_card

ROOT = Path(__file__).parents[2]
JUDGES = [
    path
    for folder in ("src/neumat/studies", "src/neumat/metrics", "src/neumat/stability", "workflow/scripts")
    for path in (ROOT / folder).glob("*.py")
]


@pytest.fixture(scope="module")
def model():
    generator = torch.Generator().manual_seed(0)
    weights = torch.randn(12, 675, generator=generator) * 0.1
    config = {"network": {"width": 16, "depth": 1}, "components": 4, "steps": 20, "batch": 8, "nfe": 8}
    index = torch.arange(12).numpy()
    base = make("hyperdiffusion", config).fit(Dataset(weights, index, index % 6, index >= 0), seed=0)
    conditions = {"type": torch.zeros(12, 0), "category": torch.eye(12)[:, :3], "said": torch.ones(12)}
    conditions |= {name: torch.nn.functional.normalize(torch.randn(12, 1, 4, generator=generator), dim=2)
                   for name in ("text", "image")}  # fmt: skip
    conditions["category"][3:, 0] = 1
    extra = {"rows": torch.randn(3, 4, generator=generator), "numbers": torch.arange(3)}
    return ConditionalDiffusion(base, Tuning(steps=20, batch=8), {}, extra).fit(weights, conditions, seed=1)


def test_a_packaged_model_samples_nearly_what_its_original_does(model, tmp_path):
    write_packaged(tmp_path / "half.safetensors", model)
    model.save(tmp_path / "whole.safetensors")
    half, whole = ((tmp_path / f"{name}.safetensors").stat().st_size for name in ("half", "whole"))
    assert half < 0.6 * whole
    loaded = ConditionalDiffusion.load(tmp_path / "half.safetensors")
    assert torch.equal(loaded.extra["numbers"], model.extra["numbers"])
    request = {"text": torch.eye(4)[:1]}
    found, expected = (one.draw(8, 0, request, 1.0) for one in (loaded, model))
    assert found.dtype == torch.float32 and not torch.equal(found, expected)
    assert (found - expected).abs().max() < 0.02 * expected.std()
    assert all(value.dtype != torch.float16 for value in model.state.values())  # the original stays


def test_what_is_too_large_for_the_package_is_refused_and_not_left_behind(model, tmp_path, monkeypatch):
    monkeypatch.setattr(packaged, "LARGEST", 1000)
    with pytest.raises(NeumatError, match=r"at most 0.001 MB; found 0\.\d+ MB"):
        write_packaged(tmp_path / "half.safetensors", model)
    assert not list(tmp_path.iterdir())


def test_an_installation_without_it_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(packaged, "files", lambda package: tmp_path)
    with pytest.raises(NeumatError, match="make packaged"):
        packaged_model()


def test_the_model_in_the_package_is_small_and_of_this_version():
    try:
        path = packaged_model()
    except NeumatError:
        pytest.skip("`make packaged` has not been run")
    assert path.stat().st_size <= LARGEST
    synthesiser = Synthesiser.load()
    weights, _ = synthesiser.synthesise(2, 0, candidates=2, text="red plastic")
    assert valid(weights).all() and colour_right(appearance(weights), "red").all()
    for card in (path.with_name("model.md"), ROOT / "docs/model.md"):
        assert EMPTY not in card.read_text(encoding="utf-8")


def test_the_package_holds_what_make_puts_into_it():
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["neumat"]
    for name in ("data/model.safetensors", "data/model.md", "reporting/data/model.md"):
        assert any(fnmatch.fnmatch(name, pattern) for pattern in patterns), name


@pytest.mark.parametrize("path", JUDGES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_no_table_and_no_judge_loads_it(path):
    """It has learnt every source: whatever it is measured on, it has seen."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "load":
            assert node.args or node.keywords, f"line {node.lineno} loads a model that is not named"
        name = node.id if isinstance(node, ast.Name) else getattr(node, "attr", None)
        assert name not in ("packaged_model",)
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            assert "data/model.safetensors" not in node.value and "results/packaged" not in node.value
        if isinstance(node, ast.ImportFrom) and node.module == "neumat.conditions.packaged":
            assert {alias.name for alias in node.names} <= {"halved", "write_packaged"}


def test_no_rule_but_its_own_reads_it():
    for path in [ROOT / "Snakefile", *(ROOT / "workflow/rules").glob("*.smk")]:
        text = path.read_text(encoding="utf-8")
        if path.name not in ("packaged.smk", "common.smk"):
            assert "results/packaged" not in text and "everything" not in text, path.name


def test_halving_leaves_vectors_and_whole_numbers_as_they_are(model):
    half = halved(model)
    kinds = {value.dtype for value in half.state.values() if value.ndim > 1}
    assert kinds == {torch.float16}
    assert half.base.state["coordinates.mean"].dtype == torch.float32
    assert half.extra["numbers"].dtype == torch.int64


def test_the_card_shows_the_recipes_figures_and_says_that_they_are_not_the_models():
    facts = {"size": 11.5, "sources": 100, "blends": 300, "dense": 0, "mixing": None, "coordinates": 399}
    facts |= {"steps": 5000, "tuning": 6000}
    assert EMPTY in model_card(facts) and "dense set" not in model_card(facts)
    columns = ["method", "coverage", "low", "high", "of_copies", "precision", "novelty", "valid"]
    coverage = pd.DataFrame([
        ["hyperdiffusion", 0.04, 0.03, 0.05, 0.8, 0.02, 0.05, 1.0],
        ["copies", 0.05, 0.04, 0.06, 1.0, 0.0, 0.0, 1.0],
        ["noisy-copies", 0.045, 0.04, 0.05, 0.9, 0.01, 0.01, 1.0],
        ["held-out", *[None] * 4, 0.04, 0.04, 1.0],
    ], columns=columns).assign(folds="fold3, fold4", level=0, size=[10000, 10000, 10000, None])  # fmt: skip
    rows = [
        ["text", "report", method, "colour right", value, 9] for method, value in (("conditional", 0.9), ("null", 0.8))
    ]
    conditional = pd.DataFrame(rows, columns=["modality", "use", "method", "measure", "value", "materials"])
    card = model_card(facts | {"dense": 4000, "mixing": 0.1}, coverage, conditional)
    assert (
        "It has no figures of its own" in card
        and "fold3, fold4" in card
        and "4000 bases of the dense set" in card
        and "drawn anew" in card
    )
    assert "| text | colour right | 0.9 | 0.8 |" in card
    assert "| hyperdiffusion | 0.04 |" in card and "| held-out |" in card and "noisy-copies" not in card
