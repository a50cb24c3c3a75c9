"""The user's own materials: measured files of both kinds, under names that are none of MERL's, to the end of `all`."""

import os

import h5py
import numpy as np
import pandas as pd
import pytest
import torch
from runner import SMOKE, run

from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles
from neumat.brdf.merl import write_merl
from neumat.export.rgl import write_rgl
from neumat.fields.layout import SIZE
from neumat.tables import read_table

# As small as `all` gets: a job of each rule.
TINY = """
augment: {blends: 2}
fit: {materials_per_job: 12, first_samples: 100000, samples: 24000, polish: {samples: 10000}}
evaluate: {methods: [copies], set_size: 4, entries: 64, bootstrap: 5, folds: [3, 4]}
render: {verify_samples: 1}
conditional: {images: 1, guidances: [1.0], samples: 2}
"""
MERL = {"001": 0.1, "NA": 0.2, "my steel v1.2": 0.3, "nan": 0.5}  # name: albedo
RGL = {"1e5": 0.1, "null": 0.2, "True": 0.3, "漆 (red), 2": 0.5}


def write_as_merl(path, albedo):
    above = above_horizon()
    theta_h, _, _ = grid_angles(torch.arange(ENTRIES))
    values = albedo / np.pi + 0.2 * albedo * torch.exp(-((theta_h / 0.3) ** 2))
    tints = torch.tensor([1.0, 0.7, 0.4])
    write_merl(path, torch.where(above[:, None], values[:, None] * tints, torch.nan).numpy())


def write_as_rgl(path, albedo):
    weights = torch.randn(SIZE, generator=torch.Generator().manual_seed(0)) / 20
    weights[-3:] = torch.log1p(torch.tensor([albedo, albedo / 2, albedo / 3]) / torch.pi)
    write_rgl(path, weights, {"name": path.stem})


@pytest.mark.parametrize(
    ("kind", "suffix", "materials", "write", "more"),
    [
        ("merl", ".binary", MERL, write_as_merl, ["generalisation", "results/export/npy/my steel v1.2@rbg"]),
        ("rgl", ".bsdf", RGL, write_as_rgl, ["results/export/merl/漆 (red), 2", "results/export/glsl/sample-0"]),
    ],
)
def test_own_materials_run_to_the_end(tmp_path, monkeypatch, kind, suffix, materials, write, more):
    monkeypatch.setitem(os.environ, "OMP_NUM_THREADS", "1")
    (tmp_path / "measured").mkdir()
    for name, albedo in materials.items():
        write(tmp_path / "measured" / f"{name}{suffix}", albedo)
    sources = f"sources: {{kind: {kind}, folder: {tmp_path / 'measured'}}}\n"
    (tmp_path / "mine.yaml").write_text(TINY + sources)
    options = {"overlays": (SMOKE, tmp_path / "mine.yaml")}
    run(tmp_path, "--cores", "2", "--", "all", *more, **options)

    results, names = tmp_path / "results", sorted(materials)
    with h5py.File(results / "sources/sources.h5") as file:
        assert list(file["names"].asstr()) == names
    manifest = read_table(results / "augmerl/manifest.tsv")
    assert list(manifest["name"][: 6 * len(names) : 6]) == names
    assert set(manifest["parent_a"]) | set(manifest["parent_b"]) == set(names)
    assert list(read_table(results / "tables/categories.csv")["name"]) == names
    conditional = pd.read_csv(results / "tables/conditional.csv")
    assert set(conditional["modality"]) == {"text", "image"} and len(conditional) > 20
    assert len(pd.read_csv(results / "tables/conditional_types.csv")) == 0
    assert (results / "figures/by-type.png").stat().st_size > 1000
    assert set(read_table(results / "tables/renderer.csv")["name"]) <= set(names)
    assert all((tmp_path / target).is_dir() for target in more[1:])
