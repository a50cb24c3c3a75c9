import numpy as np
import pytest

from neumat.augment.manifest import draw_manifest, held_out_sources, protocol_indices
from neumat.errors import NeumatError

CONFIG = {"blends": 300, "components": 300, "weight_range": [0.3, 0.7], "held_out": 0.05}
NAMES = [f"m{i}" for i in range(100)]


@pytest.fixture(scope="module")
def manifest():
    return draw_manifest(NAMES, CONFIG, 0)


def test_counts_are_the_papers(manifest):
    assert len(manifest) == 2400
    assert manifest["name"].is_unique
    assert (manifest["index"] == np.arange(2400)).all()
    assert (manifest["grouped"] == "test").sum() == (manifest["random"] == "test").sum() == 120
    assert manifest["weight"][600:].between(0.3, 0.7).all()


def test_no_blend_crosses_the_grouped_split(manifest):
    side = manifest.drop_duplicates("base").set_index("base")["grouped"]
    for parent in ("parent_a", "parent_b"):
        assert (manifest[parent].map(side) == manifest["grouped"]).all()
    assert (manifest["parent_a"] != manifest["parent_b"])[600:].all()


def test_everything_is_trained_on_and_nothing_held_out(manifest):
    train, reference = protocol_indices(manifest, "everything")
    assert train.tolist() == list(range(len(manifest))) and not len(reference)
    assert held_out_sources(manifest, "everything") == set()


@pytest.mark.parametrize("protocol", ["parity", "grouped", "fold0", "fold4"])
def test_training_never_holds_the_reference(manifest, protocol):
    train, reference = protocol_indices(manifest, protocol)
    assert len(np.intersect1d(train, reference)) == 0
    if protocol != "parity":
        ancestors = set(manifest["parent_a"][reference]) | set(manifest["parent_b"][reference])
        assert not ancestors & (set(manifest["parent_a"][train]) | set(manifest["parent_b"][train]))


def test_folds_cover_every_source_once(manifest):
    held = np.concatenate([protocol_indices(manifest, f"fold{k}")[1] for k in range(5)])
    assert sorted(held) == list(range(600))


def test_same_seed_same_manifest(manifest):
    assert manifest.equals(draw_manifest(NAMES, CONFIG, 0))
    assert not manifest.equals(draw_manifest(NAMES, CONFIG, 1))


def test_mistakes_are_named(manifest):
    with pytest.raises(NeumatError, match="fold7"):
        protocol_indices(manifest, "fold7")
    with pytest.raises(NeumatError, match="at least 4 materials"):
        draw_manifest(NAMES[:3], CONFIG, 0)
    for name in ("sample-0", "blend-000", "a@rbg", "a\tb", "", "M1"):
        with pytest.raises(NeumatError, match="rename"):
            draw_manifest([*NAMES[:5], name], CONFIG, 0)


@pytest.mark.parametrize("n", [4, 5, 6])
def test_few_sources_have_a_fold_each(n):
    drawn = draw_manifest(NAMES[:n], CONFIG, 0)
    held = [protocol_indices(drawn, f"fold{k}")[1] for k in range(min(n, 5))]
    assert all(map(len, held)) and sorted(np.concatenate(held)) == list(range(6 * n))
