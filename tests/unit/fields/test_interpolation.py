import numpy as np
import pandas as pd
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from neumat.augment.dense import RECIPE
from neumat.errors import NeumatError
from neumat.fields.interpolation import interpolated_fields, shares
from neumat.fields.store import NeuMerl


@pytest.fixture
def fitted(lambert, field):
    weights = torch.cat([lambert((0.6, 0.3, 0.1), (0.2, 0.2, 0.2)), field(0.05, 300.0, 200.0)[None]])
    return NeuMerl(weights, list("abc"), None, None, {})


def recipe(*weights, logarithmic=0, brightness=1.0, mixing=None):
    matrix = np.eye(3) if mixing is None else np.array(mixing)
    row = dict(zip(RECIPE, ["dense-00000", *"abc", *weights, logarithmic, brightness, *matrix.ravel()], strict=True))
    return pd.DataFrame([row])


def test_a_parent_alone_is_its_field(fitted):
    for k in range(3):
        found = interpolated_fields(recipe(*np.eye(3)[k]), fitted, "here")
        torch.testing.assert_close(found[0], fitted.weights[k])


def test_blends_of_logarithms_are_interpolations(fitted):
    found = interpolated_fields(recipe(0.2, 0.5, 0.3, logarithmic=1), fitted, "here")[0]
    torch.testing.assert_close(found, torch.tensor([0.2, 0.5, 0.3]) @ fitted.weights, rtol=1e-3, atol=1e-3)


def test_a_blend_with_a_highlight_takes_more_of_its_field_than_its_weight(fitted):
    found = interpolated_fields(recipe(0.0, 0.5, 0.5), fitted, "here")[0]
    share = (found / fitted.weights[2])[0]
    assert 0.5 < share < 1


def test_colours_and_brightness_are_those_of_the_recipe(fitted):
    green = [[0, 1, 0], [1, 0, 0], [0, 0, 1]]
    found = interpolated_fields(recipe(1.0, 0.0, 0.0, mixing=green, brightness=0.5), fitted, "here")[0]
    torch.testing.assert_close(found[-3:], fitted.weights[0][-3:][[1, 0, 2]] / 2)


@given(seed=st.integers(0, 10**6), count=st.integers(1, 3))
def test_shares_are_the_nearest_within_their_bounds(seed, count):
    generator = torch.Generator().manual_seed(seed)
    terms, target = torch.randn(4, 3, 20, generator=generator), torch.randn(4, 20, generator=generator)
    used = (torch.arange(3) < count).expand(4, 3)
    found = shares(terms, target, used)
    assert (found >= 0).all() and (found[:, count:] == 0).all()
    torch.testing.assert_close(found.sum(1), torch.ones(4))
    others = torch.rand(200, 3, generator=generator) * used[0]
    others = others / others.sum(1, keepdim=True)

    def error(some):
        return (torch.einsum("nsk,nkm->nsm", some, terms) - target[:, None]).square().sum(2)

    assert (error(found[:, None]) <= error(others.expand(4, -1, -1)) * 1.0001).all()


def test_a_parent_without_a_field_is_named(fitted):
    with pytest.raises(NeumatError, match="here: expected the parents of the dense set; found no z"):
        interpolated_fields(recipe(1.0, 0.0, 0.0).assign(parent_b="z"), fitted, "here")
