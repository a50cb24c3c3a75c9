import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.fields.layout import SIZE, permute_channels
from neumat.generative.denoisers import LEVEL_WIDTH
from neumat.generative.orders import ORDERS, OrderOfRequest, brightest_first, colours, reorder


def fields(n=5):
    weights = 0.2 * torch.randn(n, SIZE, generator=torch.Generator().manual_seed(0))
    weights[:, -3:] += 2  # nowhere black
    return weights


def test_reordering_takes_channels_as_the_permutation_of_that_name_does():
    weights = fields(6)
    expected = torch.stack([permute_channels(w, order) for w, order in zip(weights, PERMUTATIONS, strict=True)])
    assert torch.equal(reorder(weights, torch.arange(6)), expected)
    inverse = (ORDERS.argsort(1)[:, None] == ORDERS).all(2).int().argmax(1)
    assert torch.equal(reorder(expected, inverse), weights)


def test_all_permutations_of_a_material_are_sorted_alike():
    weights = fields()
    expected, _ = brightest_first(weights)
    for order in PERMUTATIONS:
        permuted = permute_channels(weights, order)
        found, back = brightest_first(permuted)
        assert torch.equal(found, expected)
        assert torch.equal(reorder(expected, back), permuted)
    means = colours(expected).mean(2)
    assert (means[:, 0] > means[:, 1]).all() and (means[:, 1] > means[:, 2]).all()


def test_colours_of_constant_fields_are_the_logarithms_of_their_reflectance():
    weights = torch.zeros(2, SIZE)
    weights[0, -3:] = torch.tensor([0.1, 0.2, 0.3]).log1p()
    weights[1, -3:] = torch.tensor([torch.nan, torch.inf, -5.0])
    found = colours(weights)
    assert torch.allclose(found[0], (torch.tensor([0.1, 0.2, 0.3]) + 1e-3).log()[:, None].expand(-1, 3))
    assert found.isfinite().all()


def test_an_order_is_judged_by_the_colours_it_gives_and_without_a_request_all_are_alike():
    torch.manual_seed(0)
    judge = OrderOfRequest(lambda asked, present: asked * present.sum(1, keepdim=True))
    weights, asked = fields(3), torch.randn(3, LEVEL_WIDTH)
    logits = judge(colours(weights), asked, torch.ones(3, 1))
    green_first = judge(colours(permute_channels(weights, "grb")), asked, torch.ones(3, 1))
    assert torch.allclose(logits[:, PERMUTATIONS.index("grb")], green_first[:, 0], atol=1e-5)
    assert logits.std(1).min() > 0
    assert torch.equal(judge(colours(weights), asked, torch.zeros(3, 1)), torch.zeros(3, 6))
