from pathlib import Path

import numpy as np
import pytest
import torch
import yaml
from PIL import Image

from neumat import synthesise
from neumat.brdf.merl import read_merl
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE

ROOT = Path(__file__).parents[2]


@pytest.fixture
def asked(monkeypatch):
    """What the model is asked for; it answers with even grey fields."""
    calls = []

    class Grey:
        @classmethod
        def load(cls, path):
            return cls()

        def synthesise(self, n, seed, guidance, candidates, **request):
            calls.append((n, seed, guidance, candidates, request))
            weights = torch.zeros(n, SIZE)
            weights[:, -3:] = np.log1p(0.2)
            return weights, n

    monkeypatch.setattr(synthesise, "Synthesiser", Grey)
    monkeypatch.setattr(
        synthesise, "render_grid", lambda w, columns, size, spp: np.zeros((4, 4 * columns, 3), np.uint8)
    )
    return calls


def test_a_request_becomes_a_preview_weights_and_tables(asked, tmp_path):
    synthesise.main(["--text", "grey paper", "-n", "2", "--guidance", "1", "--merl", "--output", str(tmp_path / "new")])
    request = {"type": None, "category": None, "text": "grey paper", "image": None}
    assert asked == [(2, 0, 1.0, None, request)]
    assert np.load(tmp_path / "new/weights.npy").shape == (2, SIZE)
    assert Image.open(tmp_path / "new/preview.png").size == (8, 4)
    table = np.asarray(read_merl(tmp_path / "new/material-1.binary"))
    assert np.nanmax(np.abs(table[np.isfinite(table).all(1)] - 0.2)) < 1e-4


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["request", "--type, --category, --text, --image", "none"]),
        (["--text", " "], ["text", "empty"]),
        (["--category", "shiny"], ["category", "mirror", "shiny"]),
        (["--text", "red", "-n", "0"], ["n:", "at least 1", "0"]),
        (["--text", "red", "--candidates", "0"], ["candidates", "at least 1"]),
        (["--text", "red", "--guidance", "nan"], ["guidance", "finite"]),
        (["--text", "red", "--guidance", "-2"], ["guidance", "-1", "-2"]),
        (["--image", "absent.png"], ["absent.png"]),
        (["--text", "red", "--output", "file"], ["--output", "folder", "file"]),
        (["--text", "red", "--output", "file/in/it"], ["--output", "folder", "file"]),
    ],
)
def test_a_mistake_ends_in_one_line_before_the_model_is_read(arguments, words, tmp_path, monkeypatch):
    class Unread:
        @classmethod
        def load(cls, path):
            raise AssertionError("the model was read")

    monkeypatch.setattr(synthesise, "Synthesiser", Unread)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(NeumatError) as error:
        synthesise.main(arguments)
    message = str(error.value)
    assert len(message.splitlines()) == 1 and all(word in message for word in words), message
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_help_says_the_defaults_of_the_configuration():
    conditional = yaml.safe_load((ROOT / "config/config.yaml").read_text())["conditional"]
    text = " ".join(synthesise.parser().format_help().split())
    guidance = conditional["guidance"]
    assert guidance["category"] == guidance["image"]
    said = f"type {guidance['type']:g}, text {guidance['text']:g}, category and image {guidance['image']:g}"
    assert said in text and f"by default {conditional['candidates']})" in text
