import h5py
import numpy as np
import torch

from neumat.augment.manifest import draw_manifest
from neumat.fields.layout import SIZE
from neumat.fields.store import PER_MATERIAL, read_neumerl, write_neumerl

NAMES = ["漆 (red), 2", "001", "NA", "déjà vu"]


def test_names_come_back_letter_for_letter(tmp_path):
    manifest = draw_manifest(NAMES, {"blends": 2, "held_out": 0.2, "weight_range": [0.3, 0.7]}, 0)
    fits = {key: np.zeros(len(manifest)) for key in PER_MATERIAL}
    write_neumerl(tmp_path / "neumerl.h5", manifest, torch.zeros(len(manifest), SIZE), fits, {})
    assert read_neumerl(tmp_path / "neumerl.h5").names == list(manifest["name"])
    with h5py.File(tmp_path / "neumerl.h5") as file:
        assert file["parents"].asstr()[:].tolist() == manifest[["parent_a", "parent_b"]].to_numpy().tolist()
