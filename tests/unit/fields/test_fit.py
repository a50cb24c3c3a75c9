import pytest
import torch

from neumat.brdf.analytic import GGX
from neumat.brdf.coordinates import above_horizon, grid_angles
from neumat.fields import fit as fit_module
from neumat.fields.field import evaluate_inputs, log_reflectance
from neumat.fields.fit import (
    GROUP,
    Directions,
    first_field,
    fit,
    gradient,
    learning_rate,
    losses,
    random_weights,
    revive,
    stacked,
    training_order,
)
from neumat.fields.layout import WIDTHS, matrices, size, unpack
from neumat.fields.mirrored import unfolded_error

CONFIG = {
    "samples": 100_000,
    "batch_size": 256,
    "first_samples": 100_000,
    "learning_rate": 5e-3,
    "polish": {"samples": 50_000, "batch_size": 256, "learning_rate": 3e-3},
    "schedule": "cosine",
    "precision": "float32",
    "highlight_share": 0.75,
}


@pytest.fixture(scope="module")
def problem():
    entries = torch.nonzero(above_horizon())[::23, 0]
    angles = grid_angles(entries)
    materials = [GGX(alpha, f0) for alpha, f0 in ((0.5, (0.9, 0.6, 0.3)), (0.3, (0.04,) * 3), (0.8, (0.5,) * 3))]
    values = torch.stack([material.eval(*angles) for material in materials], 1).half()
    return Directions(entries, 0), values, random_weights(WIDTHS, 0, "first")


@pytest.mark.parametrize("widths", [WIDTHS, (6, 8, 8, 3)])
def test_gradient_is_that_of_the_loss(widths):
    generator = torch.Generator().manual_seed(2)
    weights = (torch.randn(3, size(widths), generator=generator) * 0.3).requires_grad_()
    x, cosine = torch.randn(50, 6, generator=generator), torch.rand(50, generator=generator)
    target = torch.rand(3, 3, 50, generator=generator)
    found = torch.log1p(torch.expm1(log_reflectance(weights, x, widths)) * cosine[:, None]).transpose(1, 2)
    (found - target).abs().mean((1, 2)).sum().backward()
    inputs = torch.cat([x, torch.ones(50, 1)], 1)
    parts = gradient(stacked(weights.detach(), widths), inputs, cosine, target, torch.float32)
    for part, wanted in zip(parts, matrices(weights.grad, widths), strict=True):
        torch.testing.assert_close(part.mT, wanted, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"polish": {"samples": 0}},
        {"samples": 0, "polish": {"samples": 100_000, "batch_size": 256, "learning_rate": 1e-2}},
    ],
    ids=["both", "Adam alone", "SOAP alone"],
)
def test_a_fit_learns_what_a_constant_cannot(problem, change):
    directions, values, first = problem
    result = fit(values, directions, first, CONFIG | change, 0)
    assert (result["loss_grid"] < 0.25 * result["loss_constant"]).all()
    assert result["converged"].all()
    assert not result["retried"].any()


def test_a_polish_lowers_the_loss(problem):
    directions, values, first = problem
    polished, plain = (fit(values, directions, first, CONFIG | c, 0) for c in ({}, {"polish": {"samples": 0}}))
    assert (polished["loss_grid"] < 0.9 * plain["loss_grid"]).all()


def test_a_result_does_not_depend_on_its_neighbours(problem):
    directions, values, first = problem
    short = CONFIG | {"samples": 5_000}
    together, alone = (fit(part, directions, first, short, 0) for part in (values, values[:, 1:2]))
    for key in ("weights", "loss_grid", "loss_uniform"):
        assert torch.equal(together[key][1:2], alone[key]), key


def test_a_full_group_gives_what_short_ones_do(problem):
    directions, values, first = problem
    short = CONFIG | {"samples": 2_000, "polish": CONFIG["polish"] | {"samples": 2_000}}
    many = values[:, torch.arange(GROUP) % values.shape[1]]
    whole = fit(many, directions, first, short, 0)["weights"]
    parts = torch.cat([fit(part, directions, first, short, 0)["weights"] for part in many.split(20, 1)])
    assert torch.equal(whole, parts)


def test_a_diverging_fit_is_retried_and_flagged(problem):
    directions, values, first = problem
    broken = torch.full_like(first, float("nan"))
    result = fit(values, directions, broken, CONFIG | {"samples": 20_000}, 0)
    assert result["retried"].all()
    assert result["weights"].isfinite().all()


def test_losses_of_the_exact_field_are_zero(problem):
    directions, _, _ = problem
    weights = torch.randn(2, size(), generator=torch.Generator().manual_seed(5)) * 0.2
    values = evaluate_inputs(weights, directions.inputs).permute(1, 0, 2)
    grid, uniform, constant = losses(weights, values, directions, directions.held)
    assert grid.max() < 1e-6
    assert uniform.max() < 1e-6
    assert (constant > 1e-3).all()


def test_training_never_sees_the_held_out_entries(problem):
    directions, _, _ = problem
    order = training_order(directions, CONFIG, 0)
    assert order.shape == (CONFIG["samples"] // 256, 256)
    assert not set(order.flatten().tolist()) & set(directions.held.tolist())
    assert len(directions.held) == round(0.2 * len(directions.inputs))


def test_cosine_schedule_ends_at_zero():
    rates = [learning_rate(step, 100, CONFIG) for step in (0, 50, 100)]
    assert rates == pytest.approx([5e-3, 2.5e-3, 0])
    assert learning_rate(99, 100, CONFIG | {"schedule": "constant"}) == 5e-3


def test_dead_units_start_afresh_and_leave_the_field_as_it_is(problem):
    directions, _, first = problem
    weights = first.clone()
    (_, bias1), (_, bias2), _ = unpack(weights)
    bias1[3], bias2[5:8] = -100, -100
    revived = revive(weights, directions.inputs, random_weights(WIDTHS, 0, "fresh"))
    torch.testing.assert_close(
        log_reflectance(revived, directions.inputs), log_reflectance(weights, directions.inputs), atol=1e-5, rtol=1e-5
    )
    assert (unpack(revived)[0][1][3], unpack(revived)[1][1][5]) == (0, 0)


def test_the_first_field_keeps_nearly_all_units_at_work(problem):
    directions, values, _ = problem
    (kernel, bias), (kernel2, bias2), _ = unpack(first_field(values[:, :1], directions, CONFIG, 0))
    hidden = torch.relu(directions.inputs @ kernel + bias)
    assert (hidden > 0).any(0).sum() >= 18
    assert (hidden @ kernel2 + bias2 > 0).any(0).sum() >= 18


def test_the_first_field_is_the_best_of_several(problem, monkeypatch):
    directions, values, _ = problem
    several = first_field(values[:, :1], directions, CONFIG, 0)
    monkeypatch.setattr(fit_module, "CANDIDATES", 1)
    single = [first_field(values[:, :1], directions, CONFIG, seed) for seed in range(4)]
    loss, *others = losses(
        torch.stack([several, *single]), values[:, :1].expand(-1, 5, -1), directions, directions.train
    )[0].tolist()
    assert loss < sum(others) / len(others)


def test_fields_are_right_without_folding_too(problem):
    """Neural-BRDF's plugin hands a network the difference vector as it is, mirrored (-d_x, -d_y) half of the time."""
    directions, values, first = problem
    fitted = fit(values, directions, first, CONFIG, 0)["weights"]
    assert (unfolded_error(fitted) < 0.05).all()
