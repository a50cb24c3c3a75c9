import h5py
import numpy as np
import pytest
import torch

from neumat.augment.manifest import draw_manifest
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE, permute_channels
from neumat.fields.stages import fit_gather
from neumat.fields.store import PER_MATERIAL, read_neumerl

CONFIG = {"blends": 2, "weight_range": [0.3, 0.7], "held_out": 0.2}


def write_shard(path, bases):
    generator = torch.Generator().manual_seed(bases[0])
    weights = torch.randn(len(bases), SIZE, generator=generator)
    with h5py.File(path, "w") as file:
        file["index"] = np.array(bases) * 6
        file["weights"] = weights.numpy()
        for key in PER_MATERIAL:
            file[key] = np.ones(len(bases))
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
