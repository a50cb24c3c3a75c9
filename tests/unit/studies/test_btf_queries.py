import pytest
import torch

from neumat.btf.directions import random_pairs
from neumat.btf.endless import endless
from neumat.btf.representations.encoding import Encoding
from neumat.btf.representations.registry import make
from neumat.btf.representations.training import initial
from neumat.seeds import torch_generator
from neumat.studies.btf_queries import plain_torch, query_bench


@pytest.fixture(scope="module")
def model():
    made = make("ours", {"bits": 32})
    generator = torch_generator(0, "model")
    layers, planes = initial(made, 7, 2, generator)
    made.size = 24, 24
    plane = torch.randn(24, 24, made.channels, generator=generator)
    made.state = made._state(plane, planes, layers, Encoding(0.3, made.curve, 2.0))
    return made


def test_plain_torch_answers_as_the_representation_does(model):
    generator = torch_generator(1, "queries")
    u = torch.rand(500, 2, generator=generator, dtype=torch.float64) * 0.9 + 0.05  # borders are clamped, not wrapped
    pair = random_pairs(500, generator)
    expected = endless(model, "tiling", 0, False).eval(u, *pair)
    assert torch.allclose(plain_torch(model)(u.float(), *pair), expected, rtol=1e-3, atol=1e-5)


@pytest.mark.usefixtures("compiled")
def test_each_method_has_a_row_at_each_count(model):
    rows = query_bench(model, ["tiling", "histogram"], [100, 300], 0)
    assert list(rows["queries"]) == [100] * 4 + [300] * 4
    assert (rows.groupby("queries")["share"].first() == 1).all() and (rows["cpu_seconds"] > 0).all()
