"""Making the embedded materials from published fields."""

import zipfile

import pytest
import torch

from neumat.brdf import embedded
from neumat.brdf.coordinates import half_difference
from neumat.errors import NeumatError
from neumat.fields import distill
from neumat.fields.field import log_reflectance
from neumat.fields.fit import random_weights
from neumat.fields.layout import WIDTHS
from neumat.seeds import torch_generator

DIRECTIONS = torch.rand(3, 500, generator=torch.Generator().manual_seed(0)) * torch.tensor([[1.0], [0.5], [3.0]])


@pytest.fixture(scope="module")
def teachers():
    weights = torch.stack([random_weights(WIDTHS, 0, f"teacher {k}") for k in range(2)])
    weights[:, -3:] += 1  # the last biases: reflectance above 0 nearly everywhere
    return weights


def error(layers, teachers):
    """Return the mean |delta log(1 + f)| of students, (n,)."""
    found = embedded.forward([(layer[:, :-1], layer[:, -1]) for layer in layers], embedded.encode(*DIRECTIONS))
    return (found - log_reflectance(teachers, half_difference(*DIRECTIONS))).abs().mean((1, 2))


def test_a_sharp_student_starts_as_its_teacher(teachers, monkeypatch):
    blunt = error(distill.widen(teachers, torch_generator(0, "test")), teachers)
    monkeypatch.setattr(distill, "SHARPNESS", 1e4)
    sharp = error(distill.widen(teachers, torch_generator(0, "test")), teachers)
    assert (sharp < 1e-3).all() and (sharp < blunt / 10).all()


def test_training_brings_students_nearer(teachers, monkeypatch):
    monkeypatch.setattr(distill, "SHARPNESS", 2)
    monkeypatch.setattr(distill, "STEPS", 300)
    start = error(distill.widen(teachers, torch_generator(1, "distil")), teachers)
    fitted = distill.distil(teachers)
    assert (error([torch.cat([kernel, bias[:, None]], 1) for kernel, bias in fitted], teachers) < start / 3).all()


def test_foreign_files_are_refused(tmp_path):
    path = tmp_path / "nets.zip"
    path.write_text("no zip")
    with pytest.raises(NeumatError, match="no zip file"):
        distill.read_teachers(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "nothing")
    with pytest.raises(NeumatError, match=r"NBRDF \.h5 files inside; found none"):
        distill.read_teachers(path)
