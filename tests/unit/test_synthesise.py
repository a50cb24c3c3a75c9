import numpy as np
import pytest
import torch
from PIL import Image

from neumat import synthesise
from neumat.brdf.merl import read_merl
from neumat.fields.layout import SIZE


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
    assert asked == [(2, 0, 1.0, 16, request)]
    assert np.load(tmp_path / "new/weights.npy").shape == (2, SIZE)
    assert Image.open(tmp_path / "new/preview.png").size == (8, 4)
    table = np.asarray(read_merl(tmp_path / "new/material-1.binary"))
    assert np.nanmax(np.abs(table[np.isfinite(table).all(1)] - 0.2)) < 1e-4
