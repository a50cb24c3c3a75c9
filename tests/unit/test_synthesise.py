import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml
from PIL import Image

from neumat import synthesise
from neumat.brdf.merl import read_merl
from neumat.conditions import synthesis
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE

ROOT = Path(__file__).parents[2]


@pytest.fixture
def asked(monkeypatch):
    """What the model is asked for; it answers with even grey fields, brighter for the second text."""
    calls = []

    class Grey:
        @classmethod
        def load(cls, path):
            return cls()

        def synthesise_each(self, texts, n, seed, guidance, candidates, progress, **request):
            calls.append((texts, n, seed, guidance, candidates, request))
            weights = torch.zeros(len(texts), n, SIZE)
            for k in progress(range(len(texts))):
                weights[k, :, -3:] = np.log1p(0.2 * (1 + k))
            return weights, n * len(texts)

    monkeypatch.setattr(synthesis, "Synthesiser", Grey)
    monkeypatch.setattr(synthesise, "PIXELS", 16)
    return calls


NOTHING = {"type": None, "category": None, "image": None, "colour": None, "force": False}


def test_a_request_becomes_a_preview_weights_and_tables(asked, tmp_path):
    folder = tmp_path / "new"
    synthesise.main(["--text", "grey paper", "-n", "2", "--guidance", "1", "--merl", "--output", str(folder)])
    assert asked == [(["grey paper"], 2, 0, 1.0, None, NOTHING)]
    assert np.load(folder / "weights.npy").shape == (2, SIZE)
    assert Image.open(folder / "preview.png").size == (36, 16)
    table = np.asarray(read_merl(folder / "material-1.binary"))
    assert np.nanmax(np.abs(table[np.isfinite(table).all(1)] - 0.2)) < 1e-4


def test_each_line_of_a_file_is_a_request_with_a_row_of_the_preview(asked, tmp_path):
    (tmp_path / "words.txt").write_text("grey paper\n\n  white paper\n")
    preview = tmp_path / "elsewhere/sheet.png"
    given = ["--requests", str(tmp_path / "words.txt"), "--preview", str(preview), "--output", str(tmp_path), "-n", "3"]
    synthesise.main(given)
    assert asked == [(["grey paper", "white paper"], 3, 0, None, None, NOTHING)]
    assert np.load(tmp_path / "weights.npy").shape == (2, 3, SIZE)
    rows = np.asarray(Image.open(preview)).astype(int)
    assert rows.shape == (36, 56, 3) and not (tmp_path / "preview.png").exists()
    assert (rows[4:12, 4:12] < rows[24:32, 4:12]).all()


def test_help_imports_nothing_that_takes_long():
    code = "import sys\nfrom neumat.synthesise import parser\nparser().format_help()\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"torch", "numpy", "pandas", "h5py"} & set(done.stdout.split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["request", "--type, --category, --text, --image, --colour, --requests", "none"]),
        (["--text", " "], ["text", "empty"]),
        (["--category", "shiny"], ["category", "mirror", "shiny"]),
        (["--colour", "#12345"], ["colour", "#b87333", "#12345"]),
        (["--text", "red", "-n", "0"], ["n:", "at least 1", "0"]),
        (["--text", "red", "--candidates", "0"], ["candidates", "at least 1"]),
        (["--text", "red", "--guidance", "nan"], ["guidance", "finite"]),
        (["--text", "red", "--guidance", "-2"], ["guidance", "-1", "-2"]),
        (["--image", "absent.png"], ["absent.png"]),
        (["--requests", "absent.txt"], ["absent.txt", "one request a line"]),
        (["--requests", "file"], ["file", "one request a line", "no words"]),
        (["--text", "red", "--preview", "sheet"], ["--preview", ".png", "sheet"]),
        (["--text", "red", "--preview", "file/sheet.png"], ["--preview", "folder", "file"]),
        (["--text", "red", "--output", "file"], ["--output", "folder", "file"]),
        (["--text", "red", "--output", "file/in/it"], ["--output", "folder", "file"]),
    ],
)
def test_a_mistake_ends_in_one_line_before_the_model_is_read(arguments, words, tmp_path, monkeypatch):
    class Unread:
        @classmethod
        def load(cls, path):
            raise AssertionError("the model was read")

    monkeypatch.setattr(synthesis, "Synthesiser", Unread)
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
