"""What a clone holds, and what `make` would do in it."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def git(*arguments):
    done = subprocess.run(["git", "-C", ROOT, *arguments], capture_output=True, text=True)
    if done.returncode == 128:
        pytest.skip("not a git repository")
    return done


def test_git_tracks_no_results_but_the_page_about_them():
    assert git("ls-files", "results").stdout.split() == ["results/README.md"]


@pytest.mark.parametrize("path", ["results/report.html", "results/tables/run.csv", "results/smoke/a", ".venv/a"])
def test_git_ignores_what_make_writes(path):
    assert git("check-ignore", path).returncode == 0


def test_the_licence_is_packaged():
    assert "MIT License" in (ROOT / "LICENSE").read_text()
    project = (ROOT / "pyproject.toml").read_text()
    assert 'license = "MIT"' in project and 'license-files = ["LICENSE"]' in project


@pytest.fixture
def clone(tmp_path):
    """A folder with the Makefile, and an environment that counts as installed."""
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    (tmp_path / ".venv").mkdir()
    (tmp_path / ".venv/installed").touch()
    return tmp_path


def planned(folder, *targets):
    """Return the lines that `make` would run."""
    environment = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL")}
    done = subprocess.run(
        ["make", "-n", *targets], cwd=folder, env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.splitlines()


def test_the_report_of_a_fresh_clone_makes_the_run_first(clone):
    run, report = planned(clone, "report")
    assert run == ".venv/bin/snakemake"
    assert report.strip() == ".venv/bin/snakemake --report results/report.html -- all"


@pytest.mark.parametrize("made", [[], ["charts"], ["charts", "generalisation"]])
def test_the_report_takes_the_targets_that_were_made(clone, made):
    tables = clone / "results/tables"
    tables.mkdir(parents=True)
    for name in ("run", *(f"run-{target}" for target in made)):
        (tables / f"{name}.csv").touch()
    (line,) = planned(clone, "report")
    assert line.split(" -- ")[1].split() == ["all", *made]
