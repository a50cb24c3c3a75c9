import pytest
import torch

from neumat.btf.exposure import exposure
from neumat.btf.store import BtfStore
from neumat.errors import NeumatError


def store_of(values):
    up = torch.tensor([0.0, 0.0, 1.0]).expand(len(values), 1, 3)
    return BtfStore.from_arrays(values, up, up, kind="pictures")


def test_a_value_brighter_than_19_of_20_is_shown_at_six_tenths():
    values = torch.linspace(0, 2, 401)[torch.arange(400) * 7 % 401].view(4, 10, 10, 1).expand(-1, -1, -1, 3)
    assert exposure(store_of(values)) == pytest.approx(0.6 / 1.9, rel=0.01)


def test_it_scales_with_the_values():
    values = torch.rand(4, 10, 10, 3)
    assert exposure(store_of(values / 8)) == pytest.approx(8 * exposure(store_of(values)), rel=1e-2)


@pytest.mark.parametrize(("value", "expected"), [(0.0, "above 0"), (float("nan"), "finite")])
def test_black_and_broken_stores_are_refused(value, expected):
    with pytest.raises(NeumatError, match=expected):
        exposure(store_of(torch.full((2, 4, 4, 3), value)))
