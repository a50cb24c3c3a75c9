import pytest
import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.errors import NeumatError
from neumat.fields.field import evaluate
from neumat.fields.layout import SIZE, matrices, permute_channels, unpack


def random_fields(count, seed=0):
    return torch.randn(count, SIZE, generator=torch.Generator().manual_seed(seed)) * 0.3


def random_angles(count, seed=1):
    unit = torch.rand(3, count, generator=torch.Generator().manual_seed(seed))
    return unit[0] * 1.5, unit[1] * 1.5, unit[2] * 3.1


def test_the_675_vector_holds_the_published_architecture():
    shapes = [(tuple(kernel.shape), tuple(bias.shape)) for kernel, bias in unpack(torch.zeros(SIZE))]
    assert SIZE == 675
    assert shapes == [((6, 21), (21,)), ((21, 21), (21,)), ((21, 3), (3,))]


def test_a_layer_s_kernel_and_bias_are_one_matrix_of_the_same_memory():
    weights = random_fields(4)
    for matrix, (kernel, bias) in zip(matrices(weights), unpack(weights), strict=True):
        assert torch.equal(matrix, torch.cat([kernel, bias[:, None]], 1))
    matrices(weights)[2][:] = 0
    assert (unpack(weights)[2][1] == 0).all()


@pytest.mark.parametrize("permutation", PERMUTATIONS)
def test_permuting_weights_permutes_colours_exactly(permutation):
    weights, angles = random_fields(4), random_angles(300)
    order = ["rgb".index(channel) for channel in permutation]
    expected = evaluate(weights, *angles)[..., order]
    assert torch.equal(evaluate(permute_channels(weights, permutation), *angles), expected)


def test_fields_are_reciprocal_by_construction():
    theta_h, theta_d, phi_d = random_angles(300)
    weights = random_fields(4)
    here = evaluate(weights, theta_h, theta_d, phi_d)
    torch.testing.assert_close(evaluate(weights, theta_h, theta_d, phi_d + torch.pi), here, rtol=1e-3, atol=1e-4)


def test_fields_are_dark_below_the_horizon_and_never_negative():
    weights = random_fields(20)
    angles = torch.tensor([1.5]), torch.tensor([1.5]), torch.tensor([0.0])
    assert (evaluate(weights, *angles) == 0).all()
    assert (evaluate(weights, *random_angles(500)) >= 0).all()
    weights[:, -3:] = 1000.0  # fields know nothing of what lies below: there they may overflow
    assert (evaluate(weights, *angles) == 0).all()


def test_wrong_sizes_and_permutations_are_named():
    with pytest.raises(NeumatError, match="675"):
        unpack(torch.zeros(674))
    with pytest.raises(NeumatError, match="rrr"):
        permute_channels(torch.zeros(SIZE), "rrr")
