import itertools
import math

import pytest
import torch

from neumat.metrics.coverage import brightest_first, coverage, nearest, nearest_other, nearest_tinted
from neumat.metrics.materials import MaterialSet


def materials(n, seed=0):
    values = torch.empty(n, 40, 3).exponential_(generator=torch.Generator().manual_seed(seed))
    return brightest_first(MaterialSet(torch.arange(40), values))


def of(brdf):
    return MaterialSet(torch.arange(40), brdf)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_brightest_first_is_the_same_for_every_order_of_the_channels(order):
    found = materials(5)
    assert torch.equal(brightest_first(of(found.brdf[:, :, list(order)])).brdf, found.brdf)


def test_coverage_is_that_of_the_nearest_of_the_first_samples():
    held_out, samples = materials(3), materials(9, 1)
    found = coverage(held_out, samples, (2, 9))
    table = (held_out.brdf[:, None].log1p() - samples.brdf.log1p()).abs().mean((2, 3)).double()
    assert torch.allclose(found, torch.stack([table[:, :2].amin(1), table.amin(1)]), rtol=1e-5)
    assert coverage(held_out, held_out, (3,)).max() == 0


def test_broken_samples_cover_nothing_and_are_far_from_everything():
    held_out, samples = materials(3), materials(4, 1)
    broken = samples.brdf.clone()
    broken[0, 5, 1] = math.nan
    assert torch.equal(coverage(held_out, of(broken), (4,)), coverage(held_out, samples[1:], (3,)))
    assert coverage(held_out, of(broken), (1,)).isinf().all() and nearest(of(broken), held_out)[0].isinf()
    assert nearest_tinted(of(broken), held_out)[0].isinf()


def test_nearest_other_leaves_the_material_itself_out():
    twice = materials(4)
    pair = of(torch.cat([twice.brdf, twice.brdf[:1]]))
    found = nearest_other(pair)
    assert found[0] == found[-1] == 0
    assert found[1:4] == pytest.approx([nearest(pair[i : i + 1], pair[torch.arange(5) != i]).item() for i in (1, 2, 3)])


def test_a_tinted_copy_in_another_order_is_no_new_material():
    found = materials(40)
    tinted = of((found.brdf * torch.tensor([0.2, 1.7, 6.0]))[:, :, [2, 0, 1]])
    assert nearest_tinted(tinted, found).max() < 0.005 < 0.05 < nearest(tinted, found).min()
    assert (nearest_tinted(materials(9, 1), found) <= nearest(materials(9, 1), found) + 0.005).all()


def test_the_gain_is_the_best_one():
    """Beside a search over all gains of three materials with equal channels."""
    x, y = (of(materials(3, seed).brdf[:, :, :1].expand(-1, -1, 3)) for seed in (0, 1))
    gains = torch.logspace(-1.2, 1.2, 2000)[:, None, None, None]
    f, g = x.brdf[:, :, 0], y.brdf[:, :, 0]
    table = (torch.log1p(gains * f[:, None]) - torch.log1p(g)).abs().mean(3).amin(0)
    assert nearest_tinted(x, y) == pytest.approx(table.amin(1).double(), rel=0.02)
