import pytest
import torch

from neumat.brdf.analytic import Glossy, Lambert
from neumat.brdf.coordinates import cosines
from neumat.fields.field import Field
from neumat.fields.layout import SIZE, size, unpack
from neumat.scenes import fits
from neumat.scenes.fits import (
    ANYWHERE,
    MOST,
    POOL,
    Pools,
    even_queries,
    fit_analytic,
    fit_fields,
    pools,
    pruned,
    query_error,
)
from neumat.scenes.models import WIDTHS
from neumat.seeds import torch_generator

DRAWN = POOL - round(ANYWHERE * POOL)  # those at the queries themselves come first
MATTE, GLOSSY = Lambert((0.6, 0.3, 0.1)), Glossy((0.3, 0.2, 0.1), (0.05, 0.06, 0.1), 0.2)


def even(material):
    return pools({"a": even_queries(material, 0)}, {"a": material}, 0)


@pytest.fixture(scope="module")
def wide():
    """A field (1, 675) that needs many of its units."""
    weights = 0.3 * torch.randn(SIZE, generator=torch_generator(0, "wide"))
    unpack(weights)[-1][1][:] = 3.0  # so that no value is clamped at 0
    return weights[None]


@pytest.fixture(scope="module")
def wide_pools(wide):
    found = even(Field(wide[0]))
    assert found.values.min() > 0
    return found


def error_of(model, at):
    return query_error(model.material.eval(*(axis[0] for axis in at.angles)), at.values[0], at.floor[0]).item()


def test_even_queries_lie_above_the_horizon_and_weigh_their_cosine():
    angles, values, weight = even_queries(MATTE, 0)
    cos_i, cos_o = cosines(*angles)
    assert min(cos_i.min(), cos_o.min()) > 0 and len(cos_i) == 4 * POOL
    assert torch.equal(values, MATTE.eval(*angles))
    assert torch.equal(weight, cos_i[:, None].expand(-1, 3))
    assert angles[2].max() > 3 and angles[0].mean().item() == pytest.approx(0.6, abs=0.1)


def known(values, weight):
    """Queries that are told apart by theta_h, 0, 0.001, ..."""
    at = torch.arange(len(values)) * 1e-3
    return (at, torch.full_like(at, 0.1), torch.full_like(at, 0.2)), values, weight


def shares(found, count):
    """Return the shares (count,) of what was drawn that fall to each of `count` known queries."""
    index = (found.angles[0][0, :DRAWN] * 1e3).round().long()
    return torch.bincount(index, minlength=count).double() / DRAWN


def test_queries_are_drawn_by_weight_times_value(monkeypatch):
    monkeypatch.setattr(fits, "MOST", 1.0)
    values, weight = torch.rand(2, 50, 3, generator=torch_generator(0, "known"))
    weight[:10] = 0
    found = pools({"a": known(values, weight)}, {"a": MATTE}, 0)
    floor = (weight * values).sum() / weight.sum()
    assert found.floor.item() == pytest.approx(floor.item(), rel=1e-5)
    expected = (weight * (values + floor)).sum(1).double()
    expected /= expected.sum()
    error = (expected / DRAWN).sqrt()
    assert ((shares(found, 50) - expected).abs() <= 5 * error).all()
    assert (shares(found, 50)[:10] == 0).all()


def test_values_and_angles_stay_together():
    values = torch.rand(50, 3, generator=torch_generator(0, "known"))
    found = pools({"a": known(values, torch.ones(50, 3))}, {"a": MATTE}, 0)
    index = (found.angles[0][0, :DRAWN] * 1e3).round().long()
    assert torch.equal(found.values[0, :DRAWN], values[index])
    others = [axis[0, DRAWN:] for axis in found.angles]
    assert torch.equal(found.values[0, DRAWN:], MATTE.eval(*others))
    assert len(others[0]) == round(ANYWHERE * POOL) and (found.values[0, DRAWN:] > 0).all()


def test_a_single_query_stands_for_few():
    weight = torch.ones(2000, 3)
    weight[7] = 1e6
    heavy = shares(pools({"a": known(torch.ones(2000, 3), weight)}, {"a": MATTE}, 0), 2000)
    # Of the sum of all, which is nearly its own, it may take MOST; the others, together 0.002 of the sum, keep theirs.
    total = 1e6 + 1999
    expected = MOST * total / (MOST * total + 1999)
    assert heavy[7].item() == pytest.approx(expected, abs=0.02)
    assert heavy[7] < 0.5


def test_materials_in_a_pool_do_not_mix():
    both = {"a": even_queries(MATTE, 0), "b": even_queries(GLOSSY, 0)}
    found = pools(both, {"a": MATTE, "b": GLOSSY}, 0)
    assert found.values.shape == (2, POOL, 3) and found.floor.shape == (2, 1, 1)
    for k, material in enumerate((MATTE, GLOSSY)):
        assert torch.allclose(found.values[k], material.eval(*(axis[k] for axis in found.angles)), rtol=1e-5)


def test_analytic_fits_recover_their_own_kind():
    (lambert,) = fit_analytic("lambert", even(MATTE), 200, 0)
    assert torch.allclose(lambert.numbers, MATTE.albedo.float(), atol=1e-2)
    (glossy,) = fit_analytic("glossy", even(GLOSSY), 200, 0)
    expected = torch.tensor([0.3, 0.2, 0.1, 0.05, 0.06, 0.1, 0.2])
    assert torch.allclose(glossy.numbers, expected, rtol=0.05, atol=2e-3)
    for model, count in ((lambert, 3), (glossy, 7)):
        assert model.numbers.dtype == torch.float32 and len(model.numbers) == count
        assert model.seconds > 0 and not model.numbers.requires_grad


def test_sgd_fits_stay_within_what_the_model_means():
    at = even(GLOSSY)
    (sgd,) = fit_analytic("sgd", at, 60, 0)
    assert len(sgd.numbers) == 33 and sgd.numbers.isfinite().all()
    matte = torch.expm1(at.values.log1p().median(1).values)
    assert error_of(sgd, at) < 0.7 * query_error(matte[0].expand(POOL, 3), at.values[0], at.floor[0]).item()


def test_the_same_seed_gives_the_same_fit(wide, wide_pools):
    for fit in (
        lambda seed: fit_analytic("glossy", wide_pools, 5, seed)[0].numbers,
        lambda seed: fit_fields(["field-4"], wide_pools, wide, 5, seed)["field-4"][0].numbers,
    ):
        first, second, other = fit(0), fit(0), fit(1)
        assert torch.equal(first, second) and not torch.equal(first, other)


def test_fits_leave_the_fields_they_start_from_alone(wide, wide_pools):
    before = wide.clone()
    fit_fields(["field-12", "field-21"], wide_pools, wide, 3, 0)
    assert torch.equal(wide, before)


def test_wider_fields_follow_better(wide, wide_pools):
    fitted = fit_fields(["field-4", "field-8", "field-12"], wide_pools, wide, 50, 0)
    assert list(fitted) == ["field-4", "field-8", "field-12"]
    errors = {}
    for rung, (model,) in fitted.items():
        assert model.rung == rung and len(model.numbers) == size((6, WIDTHS[rung], WIDTHS[rung], 3))
        errors[rung] = error_of(model, wide_pools)
    assert errors["field-12"] < 0.8 * errors["field-4"]
    assert errors["field-12"] < errors["field-8"] < errors["field-4"]
    # The wider ones' fits, from which the narrow ones start, are part of what these cost.
    assert fitted["field-4"][0].seconds > fitted["field-8"][0].seconds > fitted["field-12"][0].seconds


def test_a_field_never_loses_by_starting_from_the_wider_one_too(wide, wide_pools):
    rungs = ["field-4", "field-8", "field-12"]
    chained = fit_fields(rungs, wide_pools, wide, 50, 0)
    single = {rung: fit_fields([rung], wide_pools, wide, 50, 0)[rung] for rung in rungs[:-1]}
    shares = [error_of(chained[rung][0], wide_pools) / error_of(single[rung][0], wide_pools) for rung in single]
    # The better is told by a part of the queries, and its mean error counts.
    assert max(shares) < 1.02 and min(shares) < 0.98


def test_a_judge_of_its_own_tells_the_runs_apart(wide, wide_pools):
    seen = []

    def last_is_best(numbers):
        seen.append(numbers)
        return torch.tensor([-float(len(seen))])

    fitted = fit_fields(["field-4"], wide_pools, wide, 5, 0, judge=last_is_best)["field-4"][0].numbers
    assert torch.equal(fitted, seen[-1][0]) and not torch.equal(fitted, seen[0][0])


def flat(layers):
    """Return the weights (n,) of the first material's layers."""
    return torch.cat([layer[0].flatten() for layer in layers])


def test_pruning_keeps_the_shape_of_a_field(wide, wide_pools):
    for width in (4, 21):
        layers = pruned(wide, wide_pools, width)
        assert [tuple(layer.shape) for layer in layers] == [(1, 7, width), (1, width + 1, width), (1, width + 1, 3)]
    assert torch.equal(flat(layers), wide[0])


def test_pruning_takes_the_units_that_do_nothing_first(wide):
    """The field's last 9 units of each layer are constant: without them it is the same."""
    weights = wide.clone()
    (w1, b1), (w2, b2), _ = unpack(weights)
    w1[..., 12:], w2[..., 12:] = 0, 0
    b1[..., 12:], b2[..., 12:] = 0.7, 0.3
    at = even(Field(weights[0]))
    layers = pruned(weights.expand(2, -1).clone(), Pools(*doubled(at)), 12)
    for k in range(2):
        shorter = Field(torch.cat([layer[k].flatten() for layer in layers]), (6, 12, 12, 3))
        found = shorter.eval(*(axis[0, :500] for axis in at.angles))
        assert torch.allclose(found, at.values[0, :500], rtol=1e-3, atol=1e-4)


def doubled(at):
    """Return the fields of Pools that hold a pool twice."""
    return [axis.expand(2, -1) for axis in at.angles], at.values.expand(2, -1, -1), at.floor.expand(2, -1, -1)


def test_pruning_beats_dropping_units_by_position(wide, wide_pools):
    weights = flat(pruned(wide, wide_pools, 12))
    kernels = unpack(wide[0])
    parts = []
    for k, (kernel, bias) in enumerate(kernels):
        rows = kernel if k == 0 else kernel[:12]
        parts += [rows[:, : 12 if k < 2 else 3].flatten(), bias[: 12 if k < 2 else 3]]
    errors = []
    for numbers in (weights, torch.cat(parts)):
        found = Field(numbers, (6, 12, 12, 3)).eval(*(axis[0] for axis in wide_pools.angles))
        errors.append(query_error(found, wide_pools.values[0], wide_pools.floor[0]).item())
    assert errors[0] < 0.5 * errors[1]


def test_query_error_is_relative_above_the_floor_and_absolute_below():
    target, floor = torch.tensor([[[100.0], [0.0]]]), torch.tensor([[[1.0]]])
    assert query_error(target + torch.tensor([[101.0], [1.0]]), target, floor).item() == pytest.approx(1)
    assert query_error(target, target, floor).item() == 0
