"""How near what is synthesised comes to a larger patch of the truth."""

import pytest
import torch

from neumat.btf.store import BtfStore
from neumat.errors import NeumatError
from neumat.studies.btf_synthesis import SIDE, split_crops, timed

EXEMPLAR = 8
UP = torch.tensor([[[0.0, 0.0, 1.0]]])


def truth(extent):
    """A truth of which each exemplar-sized square has a value of its own."""
    number = torch.arange(extent * extent).view(extent, extent) / extent**2
    values = number.repeat_interleave(EXEMPLAR, 0).repeat_interleave(EXEMPLAR, 1)
    return BtfStore.from_arrays(values[None, :, :, None].expand(-1, -1, -1, 3), UP, UP, kind="pictures", extent=extent)


@pytest.mark.parametrize(("extent", "choice", "report"), [(4, 2, 2), (6, 3, 6), (7, 3, 6)])
def test_what_is_chosen_on_is_not_reported(extent, choice, report):
    ((first, second),) = split_crops(truth(extent), 1.0)
    assert len(first) == choice and len(second) == report
    assert {crop.shape for crop in (*first, *second)} == {(SIDE * EXEMPLAR, SIDE * EXEMPLAR, 3)}
    seen = [set(crop.flatten().tolist()) for crop in (*first, *second)]
    assert all(not a & b for k, a in enumerate(seen) for b in seen[:k])


def test_a_truth_that_is_too_small_is_refused():
    with pytest.raises(NeumatError, match="at least 4 exemplars"):
        split_crops(truth(3), 1.0)


def test_a_method_tells_what_it_costs():
    plane = torch.rand(8, 8, 2, generator=torch.Generator().manual_seed(0))
    _, cost = timed("quilting", plane, 0, False)
    assert not cost["dynamic"] and cost["bytes_ratio"] > 4 and cost["fetches"] == 1
    with pytest.raises(NeumatError, match="one of tiling"):
        timed("nothing", plane, 0, False)
