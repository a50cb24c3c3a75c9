"""The stresses on a toy model with toy encoders, and that a guard which is taken away shows in the table."""

import numpy as np
import pytest
import torch
from PIL import ImageFile
from torch.nn.functional import one_hot

from neumat.brdf.categories import CATEGORIES
from neumat.brdf.coordinates import GRID
from neumat.conditions import encoders, image_files, photos, text_input
from neumat.conditions.projection import Projection, network
from neumat.conditions.synthesis import Synthesiser
from neumat.conditions.training import for_requests
from neumat.fields.layout import SIZE
from neumat.generative.base import Dataset
from neumat.generative.conditional import MODALITIES, ConditionalDiffusion, Tuning
from neumat.generative.registry import make
from neumat.generative.training import seeded
from neumat.stability.request_bench import StressBench
from neumat.stability.requests import stability_table, stresses
from neumat.stability.stress import stressed

MATERIALS = 64
TYPES = ["felt", "plastic"]
ALBEDOS = torch.tensor([[0.4, 0.02, 0.02], [0.02, 0.03, 0.3]])  # red and blue


@pytest.fixture(scope="module")
def bench(toy):
    """Near-Lambertian red and blue fields, of two types and categories, under a model trained for seconds."""
    generator = torch.Generator().manual_seed(0)
    kind = torch.arange(MATERIALS) % 2
    weights = torch.zeros(MATERIALS, SIZE)
    spread = 1 + 0.1 * torch.randn(MATERIALS, 3, generator=generator)
    weights[:, -3:] = torch.log1p(ALBEDOS[kind] * spread / torch.pi)

    encoder = toy()
    said = encoder.encode_text(["red", "blue", "a bright red plastic", "red plastic", "mirror"])
    with seeded(0):
        networks = {"text": network(toy.WORDS), "image": network(48)}
    state = {f"{side}.{k}": v for side, net in networks.items() for k, v in net.state_dict().items()}
    state |= {"mean": torch.zeros(toy.WORDS), "axes": torch.eye(toy.WORDS), "power": torch.tensor(0.0)}
    projection = Projection("toy", state)
    seen = (ALBEDOS[kind] * 255).to(torch.uint8)[:, None, None].expand(-1, 8, 8, -1)
    conditions = {
        "type": one_hot(kind, len(TYPES)).float(),
        "category": one_hot(kind + 5, len(CATEGORIES)).float(),
        "text": projection.text(said)[kind][:, None],
        "image": projection.image(encoder.encode_image(seen))[:, None],
        "said": torch.ones(len(seen)),
    }

    index = np.arange(MATERIALS)
    config = {"network": {"width": 32, "depth": 2}, "components": 8, "steps": 150, "batch": 64, "nfe": 16, "lr": 3e-3}
    base = make("hyperdiffusion", config | {"sigma_min": 0.1, "sigma_max": 20.0})
    base.fit(Dataset(weights, index, index % 6, index >= 0), seed=0)
    notes = {"encoder": "toy", "types": TYPES, "categories": list(CATEGORIES)}
    notes |= {"guidance": dict.fromkeys(MODALITIES, 1.0), "candidates": 2, "things": []}
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(encoders.ENCODERS, "toy", toy)
        extra = for_requests(projection, said, weights, encoder.encode_image(seen)[:, None])
        model = ConditionalDiffusion(base, Tuning(steps=150, batch=64), notes, extra)
        model.fit(weights, conditions, seed=1)
        synthesiser = Synthesiser(model)
    entries = torch.arange(0, np.prod(GRID), 20011)
    return StressBench(synthesiser, entries, weights, dict.fromkeys(MODALITIES, 1.0), seed=0)


def rows(bench, folder, *names):
    """Return {name: (found, guard, ok)} of the stresses of these names."""
    chosen = [stress for stress in stresses(bench, folder) if stress.name in names]
    assert len(chosen) == len(names)
    return {name: rest for name, _, *rest in (stressed(stress, folder) for stress in chosen)}


def test_what_is_expected_of_every_stress_happens(bench, check_stresses):
    table = stability_table(bench)
    check_stresses(table)
    assert {"refused", "warned", "none needed"} <= set(table["guard"])


@pytest.mark.parametrize(
    ("stress", "guard", "value"),
    [
        ("image: black", (photos, "FLATTEST"), -1.0),
        ("image: tiny, 8 x 8", (photos, "SMALLEST"), 1),
        ("image: truncated", (ImageFile, "LOAD_TRUNCATED_IMAGES"), True),
        ("image: stored on its side (EXIF)", (image_files, "ORIENTATIONS"), {}),
        ("text: nonsense, forced", (text_input, "FARTHEST"), -2.0),
        ("text: 10,000 words", (text_input.logging, "warning"), lambda *_: None),
    ],
)
def test_a_guard_that_is_gone_shows(bench, tmp_path, monkeypatch, stress, guard, value):
    assert rows(bench, _folder(tmp_path / "with"), stress)[stress][2]
    monkeypatch.setattr(*guard, value)
    found, guard, ok = rows(bench, _folder(tmp_path / "without"), stress)[stress]
    assert not ok and guard == "none", found


def _folder(path):
    path.mkdir()
    return path


def test_samples_that_are_no_brdf_show_where_none_are_drawn_anew(bench, tmp_path, monkeypatch):
    draw = ConditionalDiffusion.draw

    def broken(*args, **kwargs):
        weights = draw(*args, **kwargs)
        weights[::2] = float("nan")
        return weights

    monkeypatch.setattr(ConditionalDiffusion, "draw", broken)
    names = ("guidance 5", "type felt, text mirror", "sampling steps: 3")
    guards = {name: guard for name, (_, guard, _) in rows(bench, tmp_path, *names).items()}
    assert guards == {"guidance 5": "refused", "type felt, text mirror": "refused", "sampling steps: 3": "refused"}

    def unchecked(draw, passes, n, seed, *_):
        return draw(torch.arange(n), seed, 1.0)

    for module in ("conditional", "anew"):
        monkeypatch.setattr(f"neumat.generative.{module}.drawn_anew", unchecked)
    for found, guard, ok in rows(bench, tmp_path, *names).values():
        assert guard == "none" and not ok, found


def test_a_traceback_is_no_guard(bench, tmp_path, monkeypatch):
    def crash(*args, **request):
        raise IndexError("list index\nout of range")

    monkeypatch.setattr(Synthesiser, "encode", crash)
    (row,) = rows(bench, tmp_path, "unknown type").values()
    assert row == ["IndexError: list index out of range", "none", False]
