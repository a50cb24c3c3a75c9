import io

import pytest
import torch
from torch import nn

from neumat.errors import NeumatError
from neumat.generative import training
from neumat.generative.training import learning_rate, train


class Interrupted(Exception):
    pass


def run(checkpoint=None, stop=None, identity="config", seed=0, steps=12, precision="float32"):
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network = nn.Sequential(nn.Linear(3, 16), nn.Dropout(0.5), nn.ReLU(), nn.Linear(16, 3))

    def progress(indices):
        for step in indices:
            if step == stop:
                raise Interrupted
            seen.append(step)
            yield step

    def loss(generator):
        x = torch.randn(8, 3, generator=generator)
        return (network(x) - x.flip(-1)).square().mean()

    seen = []
    arguments = {"steps": steps, "lr": 1e-2, "warmup": 3, "precision": precision}
    train(network, loss, **arguments, seed=seed, progress=progress, checkpoint=checkpoint, identity=identity)
    return nn.utils.parameters_to_vector(network.parameters()), seen


@pytest.fixture
def checkpoint(tmp_path, monkeypatch):
    """A checkpoint that an interrupted run left after step 8."""
    monkeypatch.setattr(training, "CHECKPOINT_EVERY", 4)
    path = tmp_path / "state.pt"
    with pytest.raises(Interrupted):
        run(path, stop=10)
    return path


def test_a_resumed_run_gives_the_numbers_of_an_uninterrupted_one(checkpoint):
    resumed, steps = run(checkpoint)
    assert steps == [8, 9, 10, 11]
    assert torch.equal(resumed, run()[0])
    assert not checkpoint.exists()


@pytest.mark.parametrize("change", [{"identity": "other"}, {"seed": 1}, {"steps": 13}])
def test_a_checkpoint_of_another_run_is_not_resumed(checkpoint, change):
    weights, steps = run(checkpoint, **change)
    assert steps[0] == 0
    assert torch.equal(weights, run(**change)[0])


def test_the_global_generator_is_left_alone():
    before = torch.random.get_rng_state()
    run()
    assert torch.equal(before, torch.random.get_rng_state())


def test_bfloat16_follows_float32():
    # Autocast caches the weights it casts: were that cache to outlive a step, training would see stale weights.
    exact, coarse = (run(steps=100, precision=precision)[0] for precision in ("float32", "bfloat16"))
    start = run(steps=0)[0]
    assert (coarse - exact).norm() < 0.1 * (exact - start).norm()


def test_the_rate_warms_up_and_ends_where_it_should():
    rates = [learning_rate(step, 100, 1.0, 0.1, 10) for step in range(101)]
    assert rates[0] == pytest.approx(0.1)
    assert max(rates) == rates[9] == rates[10] == 1.0
    assert rates[100] == pytest.approx(0.1)


def test_a_diverging_loss_is_reported(monkeypatch):
    monkeypatch.setattr(training, "CHECKPOINT_EVERY", 1)
    network = nn.Linear(1, 1)
    arguments = {"steps": 2, "lr": 1.0, "seed": 0, "progress": iter, "checkpoint": None, "identity": {}}
    with pytest.raises(NeumatError, match="finite loss"):
        train(network, lambda _: network(torch.ones(1)).sum() * float("nan"), **arguments)


@pytest.mark.parametrize(
    ("cpu", "pays"),
    [
        ("vendor_id: GenuineIntel\nflags: avx512_bf16 amx_bf16", True),
        ("vendor_id: AuthenticAMD\nflags: avx512_bf16", True),
        ("vendor_id: GenuineIntel\nflags: avx512_bf16", False),
        ("vendor_id: AuthenticAMD\nflags: avx2", False),
        (None, False),  # no such file: another system
    ],
)
def test_bfloat16_is_taken_by_itself_only_where_it_was_measured_to_be_faster(cpu, pays, monkeypatch):
    def opened(path):
        if cpu is None:
            raise FileNotFoundError(path)
        return io.StringIO(cpu)

    monkeypatch.setattr(training, "open", opened, raising=False)
    assert training.bfloat16_pays(torch.device("cpu")) == pays


def test_an_unknown_precision_is_refused():
    with pytest.raises(NeumatError, match="bfloat16"):
        training.autocast("float16", torch.device("cpu"))
