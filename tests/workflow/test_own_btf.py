"""The user's own surfaces: a measured BTF, from its file to the tables and figures of `btf`, and materials of the run
on facets; and machines on which no surface can be captured."""

import os
import re
import subprocess

import pandas as pd
import pytest
import torch
from runner import SMOKE, command, planned, run

from neumat.btf.bonn_writer import write_dfmf
from neumat.btf.directions import grid, ubo2003_directions
from neumat.btf.store import BtfStore, read_btf

WANTED = ["results/btf/captures/mine/queries.h5", "results/btf/truth/mine-4x.h5"]
TINY = """
btf:
  surface: mine
  surfaces: [mine]
  queries: {sweeps: 100}
  synthesis: {representations: [], methods: [tiling, histogram]}
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with a measured BTF of random texels, and the files that name it."""
    light, view = grid(ubo2003_directions()[:7], ubo2003_directions())
    albedo = torch.rand(1, 24, 24, 3, generator=torch.Generator().manual_seed(0)) * 0.7 + 0.1
    values = albedo * light[:, 2, None, None, None] / torch.pi
    store = BtfStore.from_arrays(values, light[:, None], view[:, None], kind="pictures", size_mm=20.0)
    write_dfmf(tmp_path / "mine.btf", store, components=4)
    surface(tmp_path, "file: mine.btf\n")
    (tmp_path / "own.yaml").write_text(TINY)
    return tmp_path


def surface(folder, text):
    (folder / "config/btf").mkdir(parents=True, exist_ok=True)
    (folder / "config/btf/mine.yaml").write_text(text)


def test_a_measured_btf_runs_to_the_end(folder):
    figures = ["results/btf/figures/mine-ours.png", "results/btf/figures/mine-synthesis-4x.png"]
    tables = ["results/btf/quality/mine/ours.csv", "results/btf/synthesis/mine.csv"]
    done = run(folder, "--cores", "1", "--", *figures, *tables, overlays=(SMOKE, folder / "own.yaml"))
    assert "nothing was measured beyond the exemplar" in done.stdout + done.stderr
    assert "values contain the cosine" in done.stdout + done.stderr
    captures = {name: read_btf(folder / f"results/btf/captures/mine/{name}.h5") for name in ("queries", "held-out")}
    assert captures["queries"].kind == "queries" and captures["queries"].pairs == 64
    assert captures["held-out"].sweeps == 1 + 2 + 2 and captures["held-out"].height == 24
    assert set(pd.read_csv(folder / tables[0])["pairs"]) == {"validation", "report"}
    assert set(pd.read_csv(folder / tables[1])["part"]) == {"not measured"}
    assert all((folder / figure).stat().st_size > 1000 for figure in figures)
    assert not (folder / "results/btf/truth").exists()


def test_every_target_can_be_planned(folder):
    rules = planned(folder, "--", "btf", "btf_all", overlays=(SMOKE, folder / "own.yaml"))
    assert "btf_measured" in rules and "btf_truth" not in rules


@pytest.mark.parametrize(
    ("text", "overlay", "words"),
    [
        ("file: none.btf\n", "", "key file: expected a .btf file, or a folder or .zip of pictures; found none.btf"),
        ("file: mine.btf\ncosine: maybe\n", "", "key cosine: expected boolean"),
        ("file: mine.btf\nprocess: leather\n", "", "key process: expected one of file"),
        ("file: mine.btf\n", "  relief: {surfaces: [mine]}\n", "btf.relief.surfaces: expected surfaces with a process"),
    ],
)
def test_a_mistake_ends_in_one_line_before_anything_runs(folder, text, overlay, words):
    surface(folder, text)
    (folder / "own.yaml").write_text(TINY + overlay)
    overlays = (SMOKE, folder / "own.yaml")
    done = subprocess.run(
        command(folder, "--dry-run", "--", "btf_all", overlays=overlays), capture_output=True, text=True
    )
    said = [line for line in done.stderr.splitlines() if words in line]
    assert done.returncode != 0 and said and "Traceback" not in done.stderr, done.stderr


def test_facets_of_fitted_and_sampled_materials_wait_for_them(folder):
    (folder / "a.binary").touch()
    own = [f"process: {name}\nmaterials: [{', '.join(materials)}]\n" for name, materials in (
        ("metal", ("blend-000@rbg", "brass")), ("metal", ("brass", "a.binary")), ("metal", ("sample-1", "blend-003")),
    )]  # fmt: skip
    inputs = []
    for text in own:
        surface(folder, text)
        done = run(folder, "--dry-run", "--", *WANTED, overlays=(SMOKE, folder / "own.yaml"))
        found = re.findall(r"rule btf_(?:shard|truth):\n    (?:input: (\S.*)\n)?", done.stdout + done.stderr)
        assert len(found) > 1 and len(set(found)) == 1
        inputs.append(set(found[0].split(", ")))
    fitted, sampled = "results/neumerl/neumerl.h5", "results/samples/parity/hyperdiffusion.h5"
    assert inputs == [{fitted}, {"a.binary"}, {fitted, sampled}]


def test_a_material_that_the_run_does_not_make_is_refused(folder):
    surface(folder, "process: metal\nmaterials: [brass, sample-99]\n")
    overlays = (SMOKE, folder / "own.yaml")
    done = subprocess.run(
        command(folder, "--dry-run", "--", *WANTED, overlays=overlays), capture_output=True, text=True
    )
    assert done.returncode != 0 and "key materials" in done.stderr and "'sample-99'" in done.stderr


# What is imported first by every Python: no LLVM is to be found.
HIDDEN = """
import ctypes.util, importlib.metadata
files = importlib.metadata.files
importlib.metadata.files = lambda name: [] if name == "karellen-llvm-core" else files(name)
ctypes.util.find_library = lambda name: None
"""


@pytest.mark.skipif(torch.cuda.is_available(), reason="CUDA captures surfaces, too")
def test_without_llvm_surfaces_are_left_out(tmp_path, monkeypatch):
    (tmp_path / "hidden").mkdir()
    (tmp_path / "hidden/sitecustomize.py").write_text(HIDDEN)
    paths = [str(tmp_path / "hidden"), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    done = run(tmp_path, "--cores", "1", "--until", "sources", "--", "all")
    assert (done.stdout + done.stderr).count("surfaces are left out of `all`") == 1
    assert "surfaces are left out" not in run(tmp_path, "--dry-run", "--", "all").stderr
