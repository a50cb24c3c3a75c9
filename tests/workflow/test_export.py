"""Exports as targets, from stores that are there."""

import re
import subprocess

import h5py
import numpy as np
import pytest
import torch
from runner import command, run

from neumat.augment.manifest import draw_manifest
from neumat.export import EXPORTS, export, read_material
from neumat.fields.layout import SIZE
from neumat.fields.store import PER_MATERIAL, write_neumerl

ONLY = ["--cores", "1", "--allowed-rules", "export", "--"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with random weights as its NeuMERL and as its samples."""
    folder = tmp_path_factory.mktemp("export")
    names = ["chrome", "chrome-steel", "nickel", "teflon"]
    manifest = draw_manifest(names, {"blends": 1, "held_out": 0.2, "weight_range": [0.3, 0.7]}, 0)
    weights = torch.randn(len(manifest), SIZE, generator=torch.Generator().manual_seed(0)) / 5
    fits = {key: np.zeros(len(manifest)) for key in PER_MATERIAL}
    write_neumerl(folder / "results/neumerl/neumerl.h5", manifest, weights, fits, {})
    samples = folder / "results/samples/parity/hyperdiffusion.h5"
    samples.parent.mkdir(parents=True)
    with h5py.File(samples, "w") as file:
        file["samples"] = weights.flip(0).numpy()
    return folder, dict(zip(manifest["name"], weights, strict=True)), weights.flip(0)


def test_smoke_makes_every_format(tmp_path):
    done = run(tmp_path, "--dry-run", "--", "smoke")
    assert set(re.findall(r"output: results/export/(\w+)/", done.stdout)) == set(EXPORTS)


def test_target_is_what_the_python_call_writes(folder, tmp_path):
    folder, weights, samples = folder
    for format, name, expected in [
        ("npy", "blend-000@rbg", weights["blend-000@rbg"]),
        ("glsl", "chrome", weights["chrome"]),
        ("safetensors", "sample-3", samples[3]),
    ]:
        run(folder, *ONLY, f"results/export/{format}/{name}")
        made = folder / f"results/export/{format}/{name}"
        store = "results/samples/parity/hyperdiffusion.h5" if name == "sample-3" else "results/neumerl/neumerl.h5"
        export(expected, format, tmp_path / format, name, store)
        for path in (tmp_path / format).iterdir():
            # The library writes the metadata of .safetensors in any order.
            assert sorted((made / path.name).read_bytes()) == sorted(path.read_bytes())
        assert format == "glsl" or torch.equal(read_material(made), expected)


@pytest.mark.parametrize(
    ("name", "words"), [("chrom", "such as chrome, chrome-steel"), ("sample-99", "sample-0 to sample-29")]
)
def test_unknown_material_ends_in_one_line(folder, name, words):
    folder = folder[0]
    target = f"results/export/npy/{name}"
    done = subprocess.run(command(folder, *ONLY, target), capture_output=True, text=True)
    assert done.returncode == 1 and "Traceback" not in done.stderr + done.stdout
    log = (folder / f"results/logs/export/npy/{name}.log").read_text()
    assert len(log.splitlines()) == 1 and words in log
    assert not (folder / target).exists()
