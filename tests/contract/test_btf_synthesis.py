"""What every synthesis method of the registry must keep, whatever it does inside."""

import itertools
import math

import pytest
import torch

from neumat.btf.planes import prefilter
from neumat.btf.synthesis import SYNTHESES
from neumat.errors import NeumatError
from neumat.seeds import torch_generator

DYNAMIC = [name for name, method in SYNTHESES.items() if method.dynamic]


def noise(height, width, channels, tileable):
    """A plane of waves with random phases, which tile or not."""
    generator = torch_generator(1, height, width)
    y, x = torch.meshgrid(torch.arange(height) / height, torch.arange(width) / width, indexing="ij")
    waves = torch.randint(-6, 7, (40, 2), generator=generator) + (0 if tileable else 0.37)
    phase = waves[:, :1, None] * x + waves[:, 1:, None] * y + torch.rand(40, 1, 1, generator=generator)
    mix = torch.randn(40, channels, generator=generator)
    return torch.einsum("khw,kc->hwc", torch.sin(2 * math.pi * phase), mix) / 5


def positions(n, largest=5.0, name=""):
    return (torch.rand(n, 2, dtype=torch.float64, generator=torch_generator(2, name)) * 2 - 1) * largest


@pytest.fixture(params=[(name, tileable) for name in SYNTHESES for tileable in (False, True)], ids=str, scope="module")
def method(request):
    name, tileable = request.param
    return SYNTHESES[name](noise(32, 24, 5, tileable), 7, tileable)


def test_features_are_finite_float32_rows(method):
    features = method.at(positions(100))
    assert features.shape == (100, 5) and features.dtype == torch.float32 and features.isfinite().all()
    assert method.at(torch.empty(0, 2, dtype=torch.float64)).shape == (0, 5)


@pytest.mark.parametrize("level", [0.0, 1.0, 2.4])
def test_order_and_size_of_the_batch_change_no_bit(method, level):
    u = positions(40_000)  # more than are computed at a time
    features = method.at(u, level)
    order = torch.randperm(len(u), generator=torch_generator(3))
    assert torch.equal(method.at(u[order], level), features[order])
    assert torch.equal(method.at(u[5:18], level), features[5:18])
    assert torch.equal(torch.cat([method.at(row, level) for row in u[:40].split(1)]), features[:40])


def test_a_level_for_each_query_is_the_same_as_one_at_a_time(method):
    u, levels = positions(60), torch.linspace(-1, 7, 60)
    one = torch.cat([method.at(row, level.item()) for row, level in zip(u.split(1), levels, strict=True)])
    assert torch.equal(method.at(u, levels), one)


def test_a_cell_and_a_fraction_are_a_position(method):
    u = positions(500)
    cell = torch.floor(u)
    assert torch.equal(method.at_cell(cell.long(), u - cell), method.at(u))


@pytest.mark.parametrize("far", [-3, 10**5, -(10**5), 10**9, 10**12])
def test_texels_far_away_are_as_sharp_as_near(method, far):
    if not method.dynamic:
        pytest.skip("stored")
    cell = torch.randint(0, 50, (4000, 2), generator=torch_generator(4)) + far
    texel = torch.randint(0, 24, (4000, 2), generator=torch_generator(5))
    fraction = (texel.double() + 0.5) / torch.tensor([24.0, 32.0], dtype=torch.float64)
    features = method.at_cell(cell, fraction)
    near = method.at_cell(cell - far, fraction)
    assert features.isfinite().all()
    assert torch.allclose(features.std(0), near.std(0), rtol=0.15)
    if far <= 10**5:
        assert torch.allclose(method.at(cell + fraction), features, atol=1e-4)


def test_features_keep_within_the_exemplars_range(method):
    plane = noise(32, 24, 5, method.tileable)
    features = method.at(positions(20_000))
    slack = 1e-5  # of rounding
    assert (features >= plane.amin((0, 1)) - slack).all() and (features <= plane.amax((0, 1)) + slack).all()


def test_features_vary_continuously_over_texels_but_for_few_seams(method):
    u = positions(4000, 3)
    near = u + torch.tensor([1e-7, 0.7e-7], dtype=torch.float64)
    apart = (method.at(u) - method.at(near)).abs().amax(1)
    assert (apart > 1e-3).double().mean() < 0.002


def test_levels_beyond_the_top_are_the_top_and_nan_is_nan(method):
    u = positions(50)
    features = method.at(u, torch.full((50,), 2.0))
    for level, expected in ((math.inf, 60.0), (1e30, 60.0), (-math.inf, 0.0)):
        levels = torch.full((50,), 2.0)
        levels[7] = level
        features[7] = method.at(u[7:8], expected)
        assert torch.equal(method.at(u, levels), features)
    levels[7] = math.nan
    found = method.at(u, levels)
    assert found[7].isnan().all() and torch.equal(found[8:], features[8:]) and torch.equal(found[:7], features[:7])


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
def test_a_position_that_is_none_gives_nan_and_leaves_the_others_alone(method, bad):
    u = positions(50)
    features = method.at(u)
    u[7, 1] = bad
    found = method.at(u)
    assert found[7].isnan().all()
    others = torch.arange(50) != 7
    assert torch.equal(found[others], features[others])


@pytest.mark.parametrize("name", SYNTHESES)
@pytest.mark.parametrize("tileable", [False, True])
@pytest.mark.parametrize("size", [(1, 1), (4, 4), (16, 16), (17, 30)])
def test_a_constant_plane_stays_exactly_that(name, tileable, size):
    value = torch.tensor([0.1, -3.3, 1e-6])
    method = SYNTHESES[name](value.expand(*size, 3).clone(), 1, tileable)
    for level in (0, 0.5, 1, 3, 20):
        assert torch.equal(method.at(positions(300), level), value.expand(300, 3))


@pytest.mark.parametrize("name", SYNTHESES)
@pytest.mark.parametrize("tileable", [False, True])
@pytest.mark.parametrize("size", [(1, 5), (4, 4), (16, 16), (7, 13)])
def test_tiny_planes_keep_within_their_values(name, tileable, size):
    plane = torch.rand(*size, 2, generator=torch_generator(6))
    features = SYNTHESES[name](plane, 1, tileable).at(positions(3000))
    slack = 0.35  # decorrelated channels may leave the box
    assert features.min() > -slack and features.max() < 1 + slack


@pytest.mark.parametrize("name", SYNTHESES)
def test_two_colours_stay_two_in_their_shares(name):
    plane = (noise(64, 64, 1, True) > 0.5).float().expand(-1, -1, 3).contiguous()
    features = SYNTHESES[name](plane, 1, True).at(positions(20_000))
    assert features.min() > -1e-4 and features.max() < 1 + 1e-4
    # Corner tiles are few, and each shows patches that happened to fit.
    assert abs(features.mean() - plane.mean()) < (0.2 if name == "corner" else 0.05)


@pytest.mark.parametrize("name", SYNTHESES)
def test_the_seed_decides(name):
    plane, u = noise(32, 32, 3, True), positions(2000)
    first = SYNTHESES[name](plane, 1, True).at(u)
    assert torch.equal(SYNTHESES[name](plane, 1, True).at(u), first)
    if name != "tiling":
        assert ((SYNTHESES[name](plane, 2**40 + 2, True).at(u) - first).abs() > 1e-3).double().mean() > 0.5


@pytest.mark.parametrize("name", SYNTHESES)
@pytest.mark.parametrize("tileable", [False, True])
def test_coarser_levels_have_less_variance_and_end_at_the_mean(name, tileable):
    plane, u = noise(64, 64, 3, tileable), positions(20_000)
    method = SYNTHESES[name](plane, 1, tileable)
    variances = [method.at(u, level).var(0).sum() for level in (0, 1, 2, 3, 4, 5, 6, 7, 30)]
    assert all(after <= before * 1.02 for before, after in itertools.pairwise(variances))
    top = method.at(u, 30)
    assert (top - top[0]).abs().max() < 1e-5
    assert (top[0] - plane.mean((0, 1))).abs().max() < 0.3 * plane.std()


@pytest.mark.parametrize("name", DYNAMIC)
def test_a_dynamic_method_stores_at_most_four_times_the_plane(name):
    for size, channels in ((16, 8), (64, 3), (100, 8)):
        plane = noise(size, size, channels, False)
        assert SYNTHESES[name](plane, 1).bytes <= 4 * plane.numel() * 4


@pytest.mark.parametrize("name", SYNTHESES)
@pytest.mark.parametrize("plane", [torch.zeros(4, 4), torch.zeros(0, 4, 3), torch.full((4, 4, 1), math.nan)])
def test_planes_that_are_none_are_refused(name, plane):
    with pytest.raises(NeumatError, match="a plane of"):
        SYNTHESES[name](plane, 1)


def test_tiling_shifts_with_the_exemplar():
    plane, u = noise(32, 32, 3, True), positions(500)
    shifted = SYNTHESES["tiling"](plane.roll((5, -3), (0, 1)), 1, True)
    moved = shifted.at(u + torch.tensor([-3, 5]) / 32)
    assert torch.allclose(moved, SYNTHESES["tiling"](plane, 1, True).at(u), atol=1e-5)


@pytest.mark.parametrize("name", SYNTHESES)
@pytest.mark.parametrize("tileable", [False, True])
def test_levels_that_are_given_are_those_that_are_fetched(name, tileable):
    plane = noise(24, 17, 2, tileable)
    levels = [plane] + [torch.full((*level.shape[:2], 2), float(k)) for k, level in enumerate(prefilter(plane)[1:], 1)]
    method = SYNTHESES[name](plane, 1, tileable, levels)
    u = positions(200)
    assert torch.equal(method.at(u), SYNTHESES[name](plane, 1, tileable).at(u))
    for level in (1, 2, 2.5, 5):
        assert torch.allclose(method.at(u, level), torch.full((200, 2), float(level)), atol=1e-5)
    for wrong in (levels[:-1], [plane, *levels[:-1]], [level[..., :1] for level in levels]):
        with pytest.raises(NeumatError, match="levels of detail"):
            SYNTHESES[name](plane, 1, tileable, wrong)
