"""The papers' figures of augmentation and of the methods' first samples, on materials that reflect evenly."""

import h5py
import numpy as np
import pytest
import torch
from PIL import Image

from neumat.augment.build import build
from neumat.augment.permutations import PERMUTATIONS, channel_order
from neumat.augment.store import AugMerl
from neumat.brdf import sources as sources_module
from neumat.brdf.coordinates import ENTRIES, above_horizon
from neumat.brdf.sources import write_sources
from neumat.errors import NeumatError
from neumat.render.sphere import FrozenSphere, render_fields
from neumat.reporting import augmentation_figures as figures
from neumat.reporting.method_sheet import method_sheet, sample_pictures

ALBEDOS = {"grey": (0.3, 0.3, 0.3), "red": (0.5, 0.1, 0.2), "pale": (0.4, 0.45, 0.5), "green": (0.2, 0.6, 0.3)}


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """AugMERL of materials that reflect evenly."""
    folder = tmp_path_factory.mktemp("store")
    tables = []
    for albedo in ALBEDOS.values():
        table = np.full((ENTRIES, 3), np.nan, np.float32)
        table[above_horizon().numpy()] = np.array(albedo) / np.pi
        tables.append(table)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sources_module.SOURCES, "synthetic", lambda config: (list(ALBEDOS), iter(tables)))
        write_sources({"kind": "synthetic"}, folder / "sources.h5")
    config = {"blends": 4, "components": 10, "weight_range": [0.3, 0.7], "held_out": 0.2}
    build(folder / "sources.h5", config, 0, folder / "augmerl.h5", folder / "manifest.tsv", folder / "report.csv")
    return AugMerl(folder / "augmerl.h5", folder / "sources.h5")


@pytest.fixture(scope="module")
def frozen():
    return FrozenSphere(16)


def test_the_most_coloured_materials_stand_in_for_the_papers(store):
    assert figures.chosen_materials(store.sources) == (1, (1, 3))


def test_permuted_pictures_are_the_first_with_its_channels_in_other_orders(store, frozen):
    pictures = figures.permuted_pictures(store, frozen, 1)
    for picture, permutation in zip(pictures, PERMUTATIONS, strict=True):
        torch.testing.assert_close(picture, pictures[0][..., channel_order(permutation)])


def test_blends_run_from_one_material_to_the_other(store, frozen, lambert):
    pictures = figures.blended_pictures(store, frozen, 1, 3)
    mixed = [
        [(1 - s) * a + s * b for a, b in zip(ALBEDOS["red"], ALBEDOS["green"], strict=True)] for s in figures.SHARES
    ]
    expected = render_fields(frozen, lambert(*mixed)).int()
    for row in pictures:  # materials that reflect evenly lie in PCA space whole
        assert (row.int() - expected).abs().max() <= 1


def test_both_figures_are_written(store, frozen, tmp_path):
    figures.permutation_figure(figures.permuted_pictures(store, frozen, 1), "red", tmp_path / "permutations.png")
    figures.blend_figure(figures.blended_pictures(store, frozen, 1, 3), ("red", "green"), tmp_path / "blends.png")
    for name in ("permutations", "blends"):
        assert Image.open(tmp_path / f"{name}.png").size[0] >= 6 * 16


@pytest.fixture
def samples(tmp_path, lambert):
    """A file of weights and one of tables, each of three samples: the last two sources, and grey."""
    chosen = [2, 3, 0]
    weights = lambert(*(list(ALBEDOS.values())[i] for i in chosen))
    combinations = torch.eye(12).view(4, 3, 12)[chosen]
    for name, values, kind in (("vae-n", weights, "weights"), ("pca-a", combinations, "combinations")):
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            file["samples"] = values.numpy()
            file.attrs.update(kind=kind, stride=1)
    return [tmp_path / "vae-n.h5", tmp_path / "pca-a.h5"], weights


def test_the_first_samples_are_shown_and_no_others(store, frozen, samples):
    paths, weights = samples
    pictures = sample_pictures(paths, 2, store.sources, frozen)
    expected = render_fields(frozen, weights[:2]).int()
    assert all((found.int() - expected).abs().max() <= 1 for found in pictures)


def test_a_sheet_has_a_row_of_unenlarged_pictures_for_each_method(tmp_path):
    rows = [np.full((4, 128, 128, 3), value, np.uint8) for value in (30, 200)]
    method_sheet(["hyperdiffusion", "mine"], rows, tmp_path / "sheet.png")
    image = np.asarray(Image.open(tmp_path / "sheet.png").convert("L"))
    assert image.shape[1] == 4 * 128
    assert np.flatnonzero((image == 30).sum(1) > 256).max() < np.flatnonzero((image == 200).sum(1) > 256).min()


def test_another_file_than_samples_is_refused(store, frozen, tmp_path):
    (tmp_path / "other.h5").write_bytes(b"nothing")
    with pytest.raises(NeumatError, match="a file of samples"):
        sample_pictures([tmp_path / "other.h5"], 2, store.sources, frozen)
