import pytest
import torch

from neumat.errors import NeumatError
from neumat.fields.layout import SIZE
from neumat.fields.validity import valid
from neumat.generative.base import Dataset
from neumat.generative.conditional import MODALITIES, ConditionalDiffusion, Tuning, _given, _members
from neumat.generative.orders import OrderOfRequest
from neumat.generative.registry import make
from neumat.generative.training import device

N = 64
SIZES = {"type": 2, "category": 3, "text": 8, "image": 8}


@pytest.fixture(scope="module")
def data():
    """Two clusters of near-Lambertian fields, which type, text and image tell apart; every one is in category 1."""
    g = torch.Generator().manual_seed(0)
    kind = torch.arange(N) % 2
    weights = torch.zeros(N, SIZE)
    weights[:, -3:] = torch.where(kind[:, None] > 0, 0.05, 0.25) + 0.01 * torch.randn(N, 3, generator=g)
    embedding = torch.nn.functional.one_hot(kind, 8).float()
    category = torch.zeros(N, 3)
    category[:, 1] = 1
    category[:5, 2] = 1
    conditions = {
        "type": torch.nn.functional.one_hot(kind, 2).float(),
        "category": category,
        "text": embedding[:, None].expand(-1, 2, -1),
        "image": embedding[:, None].expand(-1, 3, -1),
        "said": torch.ones(N),
    }
    return weights, conditions


@pytest.fixture(scope="module")
def model(data):
    weights, conditions = data
    index = torch.arange(N).numpy()
    config = {"network": {"width": 32, "depth": 2}, "components": 8, "steps": 300, "batch": 64, "nfe": 16, "lr": 3e-3}
    base = make("hyperdiffusion", config | {"sigma_min": 0.1, "sigma_max": 20.0})
    base.fit(Dataset(weights, index, index % 6, index >= 0), seed=0)
    tuned = ConditionalDiffusion(
        base, Tuning(steps=300, batch=64, settled=0.1), {"types": ["a", "b"]}, {"x": torch.ones(2)}
    )
    return tuned.fit(weights, conditions, seed=1)


def one_hot(k, size):
    return torch.eye(size)[k][None]


def level(weights):
    return weights[:, -3:].mean(1)


@pytest.mark.parametrize("modality", ["type", "text", "image"])
def test_samples_follow_what_was_asked(model, modality):
    bright, dark = (model.draw(40, 2, {modality: one_hot(k, SIZES[modality])}) for k in (0, 1))
    assert (level(bright) > 0.15).float().mean() > 0.9
    assert (level(dark) < 0.15).float().mean() > 0.9


@pytest.fixture(scope="module")
def coloured(data):
    """A model that sorts channels, of fields that are red or blue as text and image say."""
    weights, conditions = data
    weights = weights.clone()
    weights[:, -3:] = 0.05 + 0.01 * torch.rand(N, 3, generator=torch.Generator().manual_seed(0))
    weights[torch.arange(N), torch.where(torch.arange(N) % 2 > 0, -1, -3)] = 0.3
    index = torch.arange(N).numpy()
    config = {"network": {"width": 32, "depth": 2}, "components": 8, "steps": 300, "batch": 64, "nfe": 16, "lr": 3e-3}
    base = make("hyperdiffusion", config | {"sigma_min": 0.1, "sigma_max": 20.0, "sort": True})
    base.fit(Dataset(weights, index, index % 6, index >= 0), seed=0)
    return ConditionalDiffusion(base, Tuning(steps=300, batch=64), {}, {}).fit(weights, conditions, seed=1)


@pytest.mark.parametrize("modality", ["text", "image"])
def test_requests_choose_the_order_of_the_channels(coloured, modality):
    for k, channel in ((0, 0), (1, 2)):
        brightest = coloured.draw(60, 2, {modality: one_hot(k, 8)})[:, -3:].argmax(1)
        assert (brightest == channel).float().mean() > 0.9


def test_the_order_of_the_channels_is_learnt_in_single_precision(data, coloured, monkeypatch):
    """In bfloat16 a material's six orders get nearly the same logits."""
    lowered, plain = [], OrderOfRequest.forward

    def forward(*given):
        lowered.append(torch.is_autocast_enabled(device().type))
        return plain(*given)

    monkeypatch.setattr(coloured.base, "precision", "bfloat16")
    monkeypatch.setattr(OrderOfRequest, "forward", forward)
    ConditionalDiffusion(coloured.base, Tuning(steps=2, batch=8), {}, {}).fit(*data, seed=1)
    assert lowered == [False, False]


def test_types_and_categories_leave_the_order_of_the_channels_open(coloured):
    for request in ({"type": one_hot(0, 2)}, {"category": one_hot(1, 3)}, {}):
        brightest = coloured.draw(240, 2, request)[:, -3:].argmax(1)
        assert brightest.bincount(minlength=3).min() > 50


def test_guidance_of_minus_one_is_the_unconditional_model_where_channels_are_sorted(coloured):
    expected = coloured.base.draw(6, seed=3)
    assert torch.equal(coloured.draw(6, 3, {"text": one_hot(0, 8)}, -1.0), expected)


def test_rows_may_ask_for_different_things(model):
    rows = torch.eye(2)[torch.arange(40) % 2]
    levels = level(model.draw(40, 2, {"type": rows}))
    assert levels[::2].mean() > 0.2 > 0.1 > levels[1::2].mean()


def test_texts_give_what_is_drawn_for_texts(data, model):
    """Where all materials have the same text, it means those that are drawn for it."""
    weights, conditions = data
    conditions = conditions | {"text": one_hot(7, 8).expand(N, 2, -1), "said": conditions["type"][:, 0]}
    tuned = ConditionalDiffusion(model.base, model.tuning, {}, {}).fit(weights, conditions, seed=1)
    assert (level(tuned.draw(40, 2, {"text": one_hot(7, 8)})) > 0.15).float().mean() > 0.9


def test_guidance_of_minus_one_is_exactly_the_unconditional_model(model):
    expected = model.base.draw(6, seed=3)
    assert torch.equal(model.draw(6, 3, {"type": one_hot(0, 2)}, -1.0), expected)
    assert torch.equal(model.draw(6, 3, {}), expected)
    assert not torch.equal(model.draw(6, 3, {"type": one_hot(0, 2)}), expected)


def test_guidance_is_linear_in_what_the_request_changes(model):
    """One Euler step from a common start: the result moves by the same amount for each unit of guidance."""
    model.base.sampler, model.base.nfe, before = "euler", 2, (model.base.sampler, model.base.nfe)
    model.base.sampling_levels = lambda: torch.tensor([5.0, 0.0])
    try:
        a, b, c = (model.draw(4, 5, {"text": one_hot(0, 8)}, w) for w in (-1.0, 0.0, 2.0))
    finally:
        model.base.sampler, model.base.nfe = before
        del model.base.sampling_levels
    assert torch.allclose(c, a + 3 * (b - a), atol=1e-4)


def test_a_saved_model_samples_the_same(model, tmp_path):
    path = tmp_path / "conditional.safetensors"
    model.save(path)
    loaded = ConditionalDiffusion.load(path)
    assert loaded.notes == model.notes and torch.equal(loaded.extra["x"], torch.ones(2))
    request = {"type": one_hot(1, 2), "image": one_hot(1, 8)}
    assert torch.equal(loaded.draw(3, 4, request, 1.0), model.draw(3, 4, request, 1.0))
    with pytest.raises(NeumatError, match="model ConditionalDiffusion"):
        ConditionalDiffusion.load(_other(tmp_path, model))


def _other(tmp_path, model):
    path = tmp_path / "base.safetensors"
    model.base.save(path)
    return path


def test_samples_stay_with_what_they_begin_with_where_little_noise_is_added(model, data):
    """At noise .2 each stays in its cluster; at 20 nothing of it is left, and the request decides."""
    weights = data[0][:40]
    assert torch.equal(level(model.draw(40, 2, {}, start=(weights, 0.2))) > 0.15, level(weights) > 0.15)
    far = level(model.draw(40, 2, {"type": one_hot(1, 2)}, start=(weights, 20.0)))
    assert (far < 0.15).float().mean() > 0.9


def test_what_is_drawn_anew_begins_with_the_same(model, data, monkeypatch):
    calls = []

    def all_broken_at_first(weights):
        calls.append(weights.clone())
        return torch.full((len(weights),), len(calls) > 1)

    monkeypatch.setattr("neumat.generative.conditional.physical", all_broken_at_first)
    weights, drawn = model.candidates(20, 2, {}, start=(data[0][:20], 0.2))
    assert drawn == 40 and not torch.equal(weights, calls[0])
    assert torch.equal(level(weights) > 0.15, level(data[0][:20]) > 0.15)


def test_broken_samples_are_drawn_anew_and_counted(model, monkeypatch):
    calls = []

    def first_half_broken(weights):
        calls.append(len(weights))
        good = torch.ones(len(weights), dtype=torch.bool)
        good[: len(weights) // 2] = len(calls) > 1
        return good

    monkeypatch.setattr("neumat.generative.conditional.physical", first_half_broken)
    weights, drawn = model.candidates(8, 1, {"type": torch.eye(2)[torch.arange(8) % 2]})
    assert drawn == 12 and torch.equal(weights[4:], model.draw(8, 1, {"type": torch.eye(2)[torch.arange(8) % 2]})[4:])
    monkeypatch.setattr("neumat.generative.conditional.physical", lambda weights: torch.zeros(len(weights), dtype=bool))
    with pytest.raises(NeumatError, match="8 broken"):
        model.candidates(8, 1, {})


def test_samples_that_other_programs_show_wrong_are_drawn_anew(model, leaning, monkeypatch):
    """Two of eight cannot be mended: others take their places, the rest stays."""
    calls = []

    def mended(weights):
        calls.append(weights.clone())
        if len(calls) == 1:
            weights[[2, 5]] = leaning(1.0)
        return weights

    monkeypatch.setattr("neumat.generative.anew.mended", mended)
    request = {"type": torch.eye(2)[torch.arange(8) % 2]}
    weights, drawn = model.sample(8, 1, request)
    assert drawn == 10 and [len(call) for call in calls] == [8, 2]
    calls[0][[2, 5]] = calls[1]
    assert torch.equal(weights, calls[0]) and valid(weights).all()


def test_wrong_requests_end_in_one_line(model):
    for request, guidance, expected in (
        ({"smell": one_hot(0, 2)}, 0, "smell"),
        ({"type": one_hot(0, 3)}, 0, "type of the request"),
        ({"text": torch.full((1, 8), float("nan"))}, 0, "text of the request: expected finite numbers; found nan"),
        ({"type": one_hot(0, 2)}, -1.5, "at least -1"),
        ({"type": one_hot(0, 2)}, float("nan"), "at least -1"),
    ):
        with pytest.raises(NeumatError, match=expected):
            model.draw(2, 0, request, guidance)
    for n in (0, -3):
        for ask in (model.draw, model.sample):
            with pytest.raises(NeumatError, match="at least 1 sample"):
                ask(n, 0, {})


def test_without_types_everything_else_can_be_asked_for(data, model, tmp_path):
    """A set whose types nobody knows: no row, no size, and one line for who asks all the same."""
    weights, conditions = data
    tuned = ConditionalDiffusion(model.base, Tuning(steps=300, batch=64, settled=0.1), {}, {})
    tuned.fit(weights, conditions | {"type": torch.zeros(N, 0)}, seed=1).save(tmp_path / "untyped.safetensors")
    loaded = ConditionalDiffusion.load(tmp_path / "untyped.safetensors")
    bright, dark = (loaded.draw(40, 2, {"text": one_hot(k, 8)}) for k in (0, 1))
    assert (level(bright) > 0.15).float().mean() > 0.9 > 0.1 > (level(dark) > 0.15).float().mean()
    with pytest.raises(NeumatError, match="expected one of category, text, image; found type"):
        loaded.draw(2, 0, {"type": torch.zeros(1, 0)})


def test_something_is_always_asked_in_training():
    given = _given(1000, len(MODALITIES), 0.3, torch.Generator().manual_seed(0))
    assert given.shape == (1000, len(MODALITIES)) and given.any(1).all()
    assert 0.3 < given.mean() < 0.4


def test_rare_categories_are_drawn_as_often_as_common_ones(data):
    category = data[1]["category"]
    asked, rows = _members(category, 2000, torch.Generator().manual_seed(0))
    assert (asked.sum(0)[1:] / 2000 - 0.5).abs().max() < 0.05 and asked[:, 0].sum() == 0
    assert (category[rows] * asked).sum(1).eq(1).all()
    assert len(rows[asked[:, 2] == 1].unique()) == 5


def test_below_the_settled_level_the_unconditional_model_finishes(model, monkeypatch):
    """With every sampling level below it, a request changes nothing."""
    monkeypatch.setattr(model.base, "sampling_levels", lambda: torch.tensor([0.05, 0.02, 0.0]), raising=False)
    expected = model.draw(4, 7, {})
    assert torch.equal(model.draw(4, 7, {"type": one_hot(0, 2)}, 3.0), expected)
