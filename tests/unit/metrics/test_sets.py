import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.metrics.sets import cov, mmd, one_nna


def line_tables(reference, samples):
    """Tables of |x - y| for points on a line."""
    r, s = torch.tensor(reference, dtype=torch.float64), torch.tensor(samples, dtype=torch.float64)
    return (r[:, None] - s).abs(), (r[:, None] - r).abs(), (s[:, None] - s).abs()


def test_by_hand():
    # References 0, 10, 20; samples 1, 2, 22.
    rs, rr, ss = line_tables([0, 10, 20], [1, 2, 22])
    assert mmd(rs) == pytest.approx((1 + 8 + 2) / 3)
    assert cov(rs) == pytest.approx(2 / 3)  # 1 and 2 cover 0, 22 covers 20
    # Nearest: 0->1 wrong, 10->2 wrong, 20->22 wrong; 1->(0 or 2, a tie) half, 2->1 right, 22->20 wrong.
    assert one_nna(rs, rr, ss) == pytest.approx(1.5 / 6)


def test_exact_copies_are_not_favoured():
    # Every point has its copy in the other set, so 1-NNA sees through it: everyone's nearest is its copy.
    rs, rr, ss = line_tables([0, 10, 20], [0, 10, 20])
    assert (mmd(rs), cov(rs), one_nna(rs, rr, ss)) == (0, 1, 0)
    # With two copies of each on both sides, a point's nearest are one of its own set and two of the other.
    rs, rr, ss = line_tables([0, 0, 10, 10], [0, 0, 10, 10])
    assert one_nna(rs, rr, ss) == pytest.approx(1 / 3)
    # Two equal references, two samples on them: each reference is missed with probability 1/4.
    assert cov(torch.zeros(2, 2)) == pytest.approx(0.75)


def test_a_broken_sample_is_counted_and_matches_nothing():
    rs, rr, ss = line_tables([0, 10, 20], [math.nan, 2, 22])
    assert mmd(rs) == pytest.approx((2 + 8 + 2) / 3)
    assert cov(rs) == pytest.approx(2 / 3)
    # 0->2, 10->2, 20->22, 22->20 and 2->0 are wrong; the broken one is told apart.
    assert one_nna(rs, rr, ss) == pytest.approx(1 / 6)
    all_broken = line_tables([0, 10, 20], [math.nan, math.nan])
    assert (mmd(all_broken[0]), cov(all_broken[0]), one_nna(*all_broken)) == (math.inf, 0, 1)


def test_equal_distributions_give_half_and_disjoint_ones_all():
    generator = torch.Generator().manual_seed(3)

    def tables(shift):
        r, s = (torch.randn(200, 2, generator=generator, dtype=torch.float64) for _ in range(2))
        s = s + shift
        return torch.cdist(r, s), torch.cdist(r, r), torch.cdist(s, s)

    mean = sum(one_nna(*tables(0)) for _ in range(10)) / 10
    assert mean == pytest.approx(0.5, abs=0.03)  # its standard error is 0.008
    assert one_nna(*tables(100)) == 1
    assert cov(tables(100)[0]) < 0.1


points = st.lists(st.integers(-5, 5), min_size=1, max_size=8)  # few values, so ties are common


@settings(max_examples=50)
@given(points, points, st.randoms(use_true_random=False))
def test_bounds_order_and_scale(reference, samples, random):
    before = line_tables(reference, samples)
    random.shuffle(reference)
    random.shuffle(samples)
    after = line_tables([3 * x for x in reference], [3 * x for x in samples])
    assert 0 <= one_nna(*before) <= 1
    assert 1 / len(reference) - 1e-9 <= cov(before[0]) <= min(1, len(samples) / len(reference)) + 1e-9
    assert mmd(after[0]) == pytest.approx(3 * mmd(before[0]))
    assert cov(after[0]) == pytest.approx(cov(before[0]))
    assert one_nna(*after) == pytest.approx(one_nna(*before))
    # The classifier does not know which set is the reference.
    rs, rr, ss = before
    assert one_nna(rs.T, ss, rr) == pytest.approx(one_nna(rs, rr, ss))
