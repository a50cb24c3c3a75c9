import pytest
import torch

from neumat.errors import NeumatError
from neumat.fields.layout import SIZE
from neumat.generative.denoisers import DENOISERS, ResidualMLP, TokenTransformer, token_groups

SMALL = {"mlp": {"width": 32, "depth": 2}, "transformer": {"tokens": 100, "width": 32, "depth": 2, "heads": 2}}


@pytest.mark.parametrize("tokens", ["layer", "neuron", 7, 64, 1000])
def test_tokens_partition_the_vector(tokens):
    groups = token_groups(SIZE, tokens)
    assert torch.equal(torch.cat(groups).sort().values, torch.arange(SIZE))
    assert len(groups) == {"layer": 3, "neuron": 45, 7: 97, 64: 11, 1000: 1}[tokens]


@pytest.mark.parametrize(("size", "tokens"), [(128, "layer"), (SIZE, "weight"), (SIZE, 0)])
def test_tokens_that_do_not_fit_are_refused(size, tokens):
    with pytest.raises(NeumatError):
        token_groups(size, tokens)


@pytest.mark.parametrize("name", DENOISERS)
def test_networks_keep_the_shape_treat_rows_alone_and_start_at_zero(name):
    network = DENOISERS[name](SIZE, **SMALL[name])
    x, c = torch.randn(5, SIZE), torch.linspace(-1, 1, 5)
    assert torch.equal(network(x, c), torch.zeros(5, SIZE))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.normal_(std=0.1)
    whole = network(x, c)
    assert whole.shape == x.shape
    assert torch.allclose(network(x[2:3], c[2:3]), whole[2:3], atol=1e-4)
    assert not torch.allclose(network(x, c + 1), whole, atol=1e-3)  # the level matters


def test_every_number_reaches_every_token_and_its_own_output():
    torch.manual_seed(0)
    network = TokenTransformer(SIZE, "neuron", width=16, depth=1, heads=2)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.normal_(std=0.2)
    x = torch.randn(1, SIZE, requires_grad=True)
    network(x, torch.zeros(1))[0, -1].backward()
    assert (x.grad != 0).all()


def test_heads_that_do_not_divide_the_width_are_refused():
    with pytest.raises(NeumatError, match="multiple of heads"):
        TokenTransformer(SIZE, "layer", width=32, heads=5)


def test_dropout_is_off_in_evaluation():
    network = ResidualMLP(10, width=16, depth=1, dropout=0.5)
    torch.nn.init.normal_(network.leave.weight)
    torch.nn.init.ones_(network.blocks[0].modulation.bias)
    x, c = torch.randn(2, 10), torch.zeros(2)
    assert not torch.equal(network(x, c), network(x, c))
    network.eval()
    assert torch.equal(network(x, c), network(x, c))
