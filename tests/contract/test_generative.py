"""One suite over every generative model at toy size."""

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from neumat.augment.permutations import PERMUTATIONS
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE, permute_channels
from neumat.generative.base import Dataset
from neumat.generative.registry import METHODS, make

COLUMNS = 12
TOY = {
    "hyperdiffusion": {"network": {"width": 32, "depth": 1}, "components": 8, "steps": 20, "batch": 16, "nfe": 6},
    "merl100": {"network": {"width": 32, "depth": 1}, "components": 8, "steps": 20, "batch": 16, "nfe": 6},
    "pca-a": {"components": 5},
    "pca-n": {"components": 5},
    "vae-a": {"steps": 20, "hidden": 16, "latent": 4},
    "vae-n": {"steps": 20, "hidden": 16, "latent": 4},
}


@pytest.fixture(scope="module")
def dataset():
    generator = torch.Generator().manual_seed(0)
    base = torch.randn(10, SIZE, generator=generator) * 0.1
    weights = torch.stack([permute_channels(base, order) for order in PERMUTATIONS], 1).flatten(0, 1)
    columns = torch.randn(COLUMNS, 40, generator=generator).double()
    coefficients = torch.randn(len(weights), 3, COLUMNS, generator=generator).numpy()
    index = np.arange(len(weights))
    return Dataset(weights, index // 6, index % 6, index < 36, coefficients, (columns @ columns.T).numpy())


@pytest.fixture(scope="module")
def fitted(dataset):
    return {name: make(name, TOY.get(name)).fit(dataset, seed=1) for name in METHODS}


@pytest.mark.parametrize("name", METHODS)
def test_samples_have_the_promised_shape_and_are_finite(fitted, name):
    model = fitted[name]
    shape = (SIZE,) if model.kind == "weights" else (3, COLUMNS)
    for n in (1, 7):
        samples = model.sample(n, seed=2)
        assert samples.shape == (n, *shape)
        assert samples.dtype == np.float32
        assert np.isfinite(samples).all()


@pytest.mark.parametrize("name", METHODS)
def test_the_seed_alone_decides_the_samples(fitted, name):
    state = torch.random.get_rng_state()
    first = fitted[name].sample(5, seed=3)
    assert np.array_equal(first, fitted[name].sample(5, seed=3))
    assert not np.array_equal(first, fitted[name].sample(5, seed=4))
    assert torch.equal(state, torch.random.get_rng_state())


@pytest.mark.parametrize("name", METHODS)
def test_a_fit_repeats_and_a_saved_model_samples_the_same(fitted, dataset, name, tmp_path):
    path = tmp_path / "model.safetensors"
    model = make(name, TOY.get(name)).fit(dataset, seed=1)
    model.save(path)
    loaded = METHODS[name].load(path)
    assert loaded == model  # the same hyperparameters
    expected = fitted[name].sample(4, seed=5)
    assert np.array_equal(model.sample(4, seed=5), expected)
    assert np.array_equal(loaded.sample(4, seed=5), expected)


@pytest.mark.parametrize("name", METHODS)
def test_mistakes_end_in_one_line(fitted, name, tmp_path):
    for action in (
        lambda: make(name).sample(1, seed=0),
        lambda: fitted[name].sample(0, seed=0),
        lambda: make(name, {"no_such_key": 1}),
    ):
        with pytest.raises(NeumatError) as error:
            action()
        assert "\n" not in str(error.value)
    other = "copies" if name != "copies" else "pca-n"
    fitted[other].save(tmp_path / "other.safetensors")
    with pytest.raises(NeumatError, match="model"):
        METHODS[name].load(tmp_path / "other.safetensors")


@pytest.mark.parametrize("name", [name for name, method in METHODS.items() if method.kind == "table"])
def test_table_models_refuse_a_dataset_without_tables(dataset, name):
    bare = Dataset(dataset.weights, dataset.base, dataset.permutation, dataset.is_source)
    with pytest.raises(NeumatError, match="gram"):
        make(name).fit(bare, seed=0)


def test_wrong_shapes_and_values_are_refused(dataset):
    rest = (dataset.base, dataset.permutation, dataset.is_source)
    broken = dataset.weights.clone()
    broken[3, 4] = float("nan")
    for arguments in (
        (dataset.weights[:, :-1], *rest),
        (dataset.weights[:-1], *rest),
        (broken, *rest),
        (dataset.weights[:1], *(part[:1] for part in rest)),
        (dataset.weights, *rest, dataset.coefficients[:, :2], dataset.gram),
    ):
        with pytest.raises(NeumatError):
            Dataset(*arguments)


def test_unreadable_files_and_other_schemas_are_refused(fitted, tmp_path, monkeypatch):
    path = tmp_path / "model.safetensors"
    for content in (None, b"", b"not a model at all"):
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(NeumatError, match=r"model\.safetensors"):
            METHODS["copies"].load(path)
    monkeypatch.setattr("neumat.generative.base.SCHEMA", "999")
    fitted["copies"].save(path)
    monkeypatch.undo()
    with pytest.raises(NeumatError, match=r"schema \d+; found 999"):
        METHODS["copies"].load(path)


def test_a_model_without_a_digest_is_refused(fitted, tmp_path):
    path = tmp_path / "model.safetensors"
    fitted["copies"].save(path)
    with safe_open(path, "pt") as file:
        metadata = {key: text for key, text in file.metadata().items() if key != "digest"}
        tensors = {name: file.get_tensor(name) for name in file.keys()}
    save_file(tensors, path, metadata)
    with pytest.raises(NeumatError, match="as it was written"):
        METHODS["copies"].load(path)


def test_an_unknown_method_is_refused():
    with pytest.raises(NeumatError, match="hyperdiffusion"):
        make("gan")
