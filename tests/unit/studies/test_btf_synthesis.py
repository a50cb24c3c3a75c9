"""How near what is synthesised comes to a larger patch of the truth."""

import pytest
import torch

from neumat.btf.endless import pixel_centres
from neumat.btf.representations.registry import make
from neumat.btf.store import BtfStore, read_btf, write_btf
from neumat.btf.synthesis import SYNTHESES
from neumat.errors import NeumatError
from neumat.metrics import textures
from neumat.studies import btf_synthesis
from neumat.studies.btf_synthesis import NEAR, PLACES, SIDE, _borders, split_crops, synthesis_table, timed

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


@pytest.mark.parametrize("place", PLACES)
def test_seams_are_looked_for_where_the_exemplars_borders_lie(place):
    """A tiled ramp steps down there and nowhere else."""
    ramp = (torch.arange(16) / 16)[None, :, None].expand(16, 16, 1)
    for axis, plane in enumerate((ramp, ramp.transpose(0, 1))):
        picture = SYNTHESES["tiling"](plane, 0).at(pixel_centres(place, SIDE, SIDE * 16)).view(SIDE * 16, SIDE * 16)
        steep = torch.nonzero(picture.diff(dim=1 - axis).abs().mean(axis) > 0.1)[:, 0] + 1
        borders = _borders(place, 16, 1)[axis]
        assert len(steep) >= SIDE and torch.isin(steep, borders).all() and len(borders) == 2 * SIDE


@pytest.fixture
def fitted(tmp_path):
    """Two fits of a noisy surface, the queries that they were fitted to, and its truth, as files."""
    generator = torch.Generator().manual_seed(0)
    values = torch.rand(4, EXEMPLAR**2, 1, generator=generator).expand(-1, -1, 3).reshape(4, EXEMPLAR, EXEMPLAR, 3)
    light, view = UP.expand(4, 1, 3), UP.expand(4, 1, 3)
    write_btf(tmp_path / "queries.h5", light, view, EXEMPLAR, EXEMPLAR, [values], kind="pictures")
    large = torch.rand(1, 4 * EXEMPLAR, 4 * EXEMPLAR, 1, generator=generator).expand(-1, -1, -1, 3)
    about = {"kind": "pictures", "extent": 4.0}
    write_btf(tmp_path / "truth.h5", UP, UP, 4 * EXEMPLAR, 4 * EXEMPLAR, [large[0]], **about)
    for name in ("ours", "neumip"):
        make(name, {"samples": 2000}).fit(read_btf(tmp_path / "queries.h5"), 0).save(tmp_path / f"{name}.safetensors")
    paths = {name: tmp_path / f"{name}.safetensors" for name in ("ours", "neumip")}
    return paths, tmp_path / "queries.h5", tmp_path / "truth.h5"


def test_other_representations_are_compared_by_the_default_method(fitted, monkeypatch):
    monkeypatch.setattr(textures, "STATISTICS", {name: textures.STATISTICS[name] for name in NEAR})
    monkeypatch.setattr(btf_synthesis, "ALL", (*NEAR, "seams"))
    rows = synthesis_table(*fitted, ["tiling", "linear"], "linear", 0)
    found = rows[rows["part"] == "report"].groupby("representation", sort=False)["method"].apply(list)
    assert found["ours"] == ["exemplar", "shuffled", "hard", "tiling", "linear"]
    assert found["neumip"] == ["exemplar", "linear"]
    hard = rows[rows["method"] == "hard"]
    assert hard["seams"].notna().all() and hard["histogram"].isna().all()
    assert rows.loc[rows["method"] == "exemplar", "histogram"].notna().all()


def test_without_a_truth_methods_tell_what_they_cost(fitted):
    rows = synthesis_table(*fitted[:2], None, ["tiling", "linear"], "linear", 0)
    assert (rows["part"] == "not measured").all() and (rows["crops"] == 0).all()
    assert rows["method"].tolist() == ["tiling", "linear", "linear"] and (rows["bytes"] > 0).all()
