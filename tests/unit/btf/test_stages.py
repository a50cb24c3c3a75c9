"""The stages from a surface to a fitted BTF."""

import pytest
import torch
from runner import ROOT

from neumat.btf.capture import gather
from neumat.btf.stages import capture_pairs, capture_shard, capture_truth, fit_representation
from neumat.btf.store import read_btf
from neumat.config import load_surface
from neumat.tables import read_table

SHARED = {"texels": 16, "quads": 1, "bounces": 2, "samples": 1}
QUERIES = SHARED | {"sweeps": 5, "pairs": 64}
HELD_OUT = SHARED | {"validation": 2, "report": 3, "shown": [[40, 30, 0, 0]]}


@pytest.fixture(scope="module")
def weave():
    return load_surface(ROOT / "config/btf/weave.yaml", ROOT / "workflow/schemas/surface.schema.json")


@pytest.mark.parametrize(("capture", "settings"), [("queries", QUERIES), ("held-out", HELD_OUT)])
def test_a_capture_is_the_same_for_any_number_of_shards(tmp_path, weave, capture, settings):
    whole = tmp_path / "whole.h5"
    capture_shard(weave, capture, settings, 1, 1, 0, whole)
    for shard in (1, 2, 3):
        capture_shard(weave, capture, settings, shard, 3, 0, tmp_path / f"{shard}.h5")
    gather([tmp_path / f"{shard}.h5" for shard in (1, 2, 3)], tmp_path / "gathered.h5")
    one, other = read_btf(whole), read_btf(tmp_path / "gathered.h5")
    order = torch.arange(one.sweeps)
    assert torch.equal(one.light, other.light) and torch.equal(one.view, other.view)
    assert torch.equal(one.values(order), other.values(order))


def test_no_held_out_pair_is_among_those_that_a_fit_sees(weave, tmp_path):
    capture_shard(weave, "queries", QUERIES, 1, 1, 0, tmp_path / "queries.h5")
    seen = read_btf(tmp_path / "queries.h5")
    seen = torch.cat([seen.light, seen.view], -1).flatten(0, 1)
    held_out = torch.cat(capture_pairs("held-out", HELD_OUT, 0), 1)
    assert torch.cdist(held_out, seen).min() > 1e-3


def test_a_truth_shows_the_surface_beyond_the_exemplar(weave, tmp_path):
    settings = SHARED | {"pairs": HELD_OUT["shown"], "samples": 64}
    capture_truth(weave, settings, 2, 0, tmp_path / "truth.h5")
    capture_truth(weave, settings, 1, 0, tmp_path / "exemplar.h5")
    truth, exemplar = read_btf(tmp_path / "truth.h5"), read_btf(tmp_path / "exemplar.h5")
    assert truth.extent == 2 and truth.height == 32
    corner = truth.values([0])[0, :16, :16].float()
    inside = (corner - exemplar.values([0])[0].float()).abs()
    assert inside.mean() < 0.5 * (corner - truth.values([0])[0, 16:, 16:].float()).abs().mean()


def test_a_fit_says_what_it_took(weave, tmp_path):
    capture_shard(weave, "queries", QUERIES, 1, 1, 0, tmp_path / "queries.h5")
    given = {"samples": 2000}
    fit_representation(tmp_path / "queries.h5", "ours", given, 0, tmp_path / "a.safetensors", tmp_path / "a.csv")
    cost = read_table(tmp_path / "a.csv").iloc[0]
    assert cost["bytes"] > 16 * 16 * 8 and cost["fit_s"] > 0
