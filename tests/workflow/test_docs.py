"""Every code block of the README and of docs/ does what it says, in a folder where the smoke run stands."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass

import pytest
import yaml
from runner import ROOT, SMOKE, command

from neumat.config import load, load_scene, load_surface

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
WHOLE_RUNS = {"all", "charts", "generalisation", "smoke"}


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    language: str
    text: str


def blocks(page):
    return [Block(*found) for found in FENCE.findall(page.read_text(encoding="utf-8"))]


WITH_BLOCKS = [page for page in PAGES if blocks(page)]


@pytest.fixture(scope="module")
def folder(smoke, tmp_path_factory):
    """A folder like the repository's root, with the results of the smoke run in it and nothing else that was made."""
    folder = tmp_path_factory.mktemp("docs")
    for name in ("config", "docs", "Makefile", "pyproject.toml", "constraints.txt"):
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, folder / name)
    for name in ("results", ".snakemake"):
        shutil.copytree(smoke / name, folder / name)
    return folder


def executed(line, folder):
    """Return the command line, as a list, that stands for one line of a shell block.

    Snakemake gets the smoke configuration, and only plans what would make whole targets; make only plans, too.
    """
    words = shlex.split(line, comments=True)
    if words[:1] == ["make"]:
        return [words[0], "-n", *words[1:]]
    if words[:1] == [".venv/bin/python"]:
        return [sys.executable, *words[1:]]
    if words[:1] != [".venv/bin/snakemake"]:
        return ["bash", "-euc", line]
    words, overlays = words[1:], [SMOKE]
    if "--configfile" in words:
        start = words.index("--configfile")
        end = next((k for k in range(start + 1, len(words)) if words[k].startswith("-")), len(words))
        overlays += [folder / name for name in words[start + 1 : end]]
        del words[start:end]
    where = folder
    if "--directory" in words:
        start = words.index("--directory")
        where = folder / words[start + 1]
        del words[start : start + 2]
    targets = [word for word in words if not word.startswith("-")]
    if not targets or WHOLE_RUNS & set(targets):
        words = [*words, *({"--dry-run"} - set(words) if not {"--unlock", "--list-rules"} & set(words) else [])]
    options = [word for word in words if word.startswith("-")]
    return command(where, "--cores", "1", *options, "--", *targets, overlays=overlays)


def environment():
    """No settings of make or Snakemake of whoever runs the tests, one thread."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("SNAKEMAKE_", "MAKE"))}
    return kept | {"OMP_NUM_THREADS": "1"}


@pytest.mark.parametrize("page", WITH_BLOCKS, ids=lambda page: page.name)
def test_blocks_run_in_the_order_of_the_page(page, folder):
    script = ""
    for block in blocks(page):
        if block.language == "python":
            script += block.text
        elif block.language == "yaml":
            name = re.match(r"# (\S+)\n", block.text)[1]
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(block.text)
        else:
            assert block.language == "sh", f"{page.name}: a block without a language that a test runs"
            for line in block.text.splitlines():
                check(executed(line, folder), folder, f"{page.name}: {line}")
    if script:
        check([sys.executable, "-c", script], folder, f"{page.name}: Python blocks")


def check(line, folder, what):
    done = subprocess.run(line, cwd=folder, env=environment(), capture_output=True, text=True)
    assert done.returncode == 0, f"{what}\n{done.stdout}{done.stderr}"


@pytest.mark.parametrize("page", WITH_BLOCKS, ids=lambda page: page.name)
def test_snippets_of_configuration_are_valid(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    schemas = ROOT / "workflow/schemas"
    for block in blocks(page):
        if block.language != "yaml":
            continue
        content = yaml.safe_load(block.text)
        if "light" in content:
            (tmp_path / "scene.yaml").write_text(block.text)
            load_scene(tmp_path / "scene.yaml", schemas / "scene.schema.json")
        elif "file" in content:
            (tmp_path / "surface.yaml").write_text(block.text)
            (tmp_path / content["file"]).touch()
            load_surface(tmp_path / "surface.yaml", schemas / "surface.schema.json")
        else:
            load(content, schemas / "config.schema.json")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_options_named_on_the_pages_exist(page):
    """A key in backticks of a section of the configuration is a key of the schema."""
    schema = json.loads((ROOT / "workflow/schemas/config.schema.json").read_text())["properties"]
    for section, *path in (name.split(".") for name in re.findall(r"`([a-z]+(?:\.[a-z_]+)+)\b", page.read_text())):
        if section not in schema:
            continue
        known = schema[section]
        for key in path:
            assert key in known.get("properties", {}), f"{page.name}: {section}.{'.'.join(path)}"
            known = known["properties"][key]
