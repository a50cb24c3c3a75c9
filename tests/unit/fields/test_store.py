import h5py
import numpy as np
import torch

from neumat.augment.manifest import draw_manifest
from neumat.fields.layout import SIZE
from neumat.fields.store import PER_MATERIAL, read_neumerl, read_requested, write_neumerl

NAMES = ["漆 (red), 2", "001", "NA", "déjà vu"]


def test_names_come_back_letter_for_letter(tmp_path):
    manifest = draw_manifest(NAMES, {"blends": 2, "held_out": 0.2, "weight_range": [0.3, 0.7]}, 0)
    fits = {key: np.zeros(len(manifest)) for key in PER_MATERIAL}
    write_neumerl(tmp_path / "neumerl.h5", manifest, torch.zeros(len(manifest), SIZE), fits, {})
    assert read_neumerl(tmp_path / "neumerl.h5").names == list(manifest["name"])
    with h5py.File(tmp_path / "neumerl.h5") as file:
        assert file["parents"].asstr()[:].tolist() == manifest[["parent_a", "parent_b"]].to_numpy().tolist()


def test_requested_fields_are_those_of_the_reported_texts_and_pictures(tmp_path):
    with h5py.File(tmp_path / "conditional.h5", "w") as file:
        for k, group in enumerate(["text/report", "image/report", "text/earlier", "type/report"]):
            file[f"{group}/samples"] = np.full((k + 2, SIZE), k, np.float32)
    assert read_requested(tmp_path / "conditional.h5")[:, 0].tolist() == [0, 0, 1, 1, 1]
