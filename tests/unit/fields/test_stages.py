import h5py
import numpy as np
import pytest
import torch

from neumat.augment.manifest import draw_manifest, protocol_indices, read_manifest
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE, permute_channels
from neumat.fields.stages import _check_finite, fit_gather
from neumat.fields.store import PER_MATERIAL, read_neumerl
from neumat.generative.dataset import training_indices

CONFIG = {"blends": 2, "weight_range": [0.3, 0.7], "held_out": 0.2}


def write_shard(path, bases, **changes):
    """Write a shard; changes: values of the second material."""
    generator = torch.Generator().manual_seed(bases[0])
    weights = torch.randn(len(bases), SIZE, generator=generator)
    with h5py.File(path, "w") as file:
        file["index"] = np.array(bases) * 6
        file["weights"] = weights.numpy()
        for key in PER_MATERIAL:
            file[key] = np.ones(len(bases), float if key.startswith("loss") else bool)
        for key, value in changes.items():
            file[key][1] = value
        file.attrs["config"] = '{"independent": false}'
    return weights


@pytest.fixture
def manifest_path(tmp_path):
    draw_manifest(list("abcd"), CONFIG, 0).to_csv(tmp_path / "manifest.tsv", sep="\t", index=False)
    return tmp_path / "manifest.tsv"


def test_gather_derives_every_permutation(tmp_path, manifest_path):
    late = write_shard(tmp_path / "2.h5", [3, 4, 5])
    write_shard(tmp_path / "1.h5", [0, 1, 2])
    fit_gather([tmp_path / "2.h5", tmp_path / "1.h5"], manifest_path, tmp_path / "neumerl.h5")
    store = read_neumerl(tmp_path / "neumerl.h5")
    assert store.weights.shape == (36, SIZE)
    assert torch.equal(store.weights[4 * 6 + 3], permute_channels(late[1], "gbr"))
    assert store.permutation[:7].tolist() == [0, 1, 2, 3, 4, 5, 0]
    assert store.base[-1] == 5


def test_a_missing_shard_is_no_store(tmp_path, manifest_path):
    write_shard(tmp_path / "1.h5", [0, 1, 2])
    with pytest.raises(NeumatError, match="18 without"):
        fit_gather([tmp_path / "1.h5"], manifest_path, tmp_path / "neumerl.h5")
    assert not (tmp_path / "neumerl.h5").exists()


def test_a_fit_that_has_not_converged_is_named_and_trains_nothing(tmp_path, manifest_path, caplog):
    write_shard(tmp_path / "1.h5", [0, 1, 2, 3, 4, 5], converged=False)
    fit_gather([tmp_path / "1.h5"], manifest_path, tmp_path / "neumerl.h5")
    assert "1 fits have not converged" in caplog.text and caplog.text.rstrip().endswith(": b")
    rows, fitted = read_manifest(manifest_path), read_neumerl(tmp_path / "neumerl.h5")
    train, _ = protocol_indices(rows, "parity")
    kept = training_indices(fitted, rows, "parity")
    assert set(train) - set(kept) == set(train) & set(range(6, 12)) and set(kept) < set(train)
    fitted.fits["converged"][:] = False
    with pytest.raises(NeumatError, match="at least 2 whose fits have converged; found 0"):
        training_indices(fitted, rows, "parity")


@pytest.mark.parametrize("change", [{"weights": np.nan}, {"loss_grid": np.inf}, {"loss_uniform": np.nan}])
def test_numbers_that_are_not_finite_pass_no_stage(tmp_path, manifest_path, change):
    write_shard(tmp_path / "1.h5", [0, 1, 2, 3, 4, 5], **change)
    with pytest.raises(NeumatError, match=r"1\.h5: expected finite numbers"):
        fit_gather([tmp_path / "1.h5"], manifest_path, tmp_path / "neumerl.h5")
    assert not (tmp_path / "neumerl.h5").exists()


def test_a_diverged_fit_ends_its_shard():
    """What `fit` returns for targets that are not numbers."""
    result = {"weights": torch.zeros(2, SIZE), "loss_grid": torch.tensor([0.1, torch.nan])}
    with pytest.raises(NeumatError, match="materials 12 of the manifest: expected finite losses"):
        _check_finite([6, 12], result)
