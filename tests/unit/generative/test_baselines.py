import numpy as np
import pytest
import torch

from neumat.fields.layout import SIZE
from neumat.generative.base import Dataset
from neumat.generative.baselines import Copies, Interpolations, Merl100, NoisyCopies, PcaA, PcaN, Span


@pytest.fixture(scope="module")
def columns():
    """Twelve columns of rank 8 over 50 entries."""
    g = torch.Generator().manual_seed(0)
    return torch.randn(12, 8, generator=g).double() @ torch.randn(8, 50, generator=g).double()


@pytest.fixture(scope="module")
def dataset(columns):
    g = torch.Generator().manual_seed(1)
    weights = 2 + torch.randn(60, SIZE, generator=g)
    coefficients = 1 + torch.randn(60, 3, 12, generator=g)
    index = np.arange(60)
    return Dataset(weights, index // 6, index % 6, index < 30, coefficients.numpy(), (columns @ columns.T).numpy())


def test_the_span_keeps_distances_between_tables(columns, dataset):
    span = Span(dataset.gram)
    encoded = span.encode(dataset.coefficients)
    assert encoded.shape == (60, 3 * 8)
    tables = (torch.as_tensor(dataset.coefficients).double() @ columns).flatten(1)
    assert torch.allclose(torch.cdist(encoded, encoded), torch.cdist(tables, tables), atol=1e-4)
    assert torch.allclose((span.decode(encoded) @ columns).flatten(1), tables, atol=1e-6)


def test_pca_a_has_the_mean_and_covariance_of_the_tables(columns, dataset):
    samples = PcaA(components=300).fit(dataset, seed=0).sample(20_000, seed=1)
    found = (torch.as_tensor(samples).double() @ columns).flatten(1)
    truth = (torch.as_tensor(dataset.coefficients).double() @ columns).flatten(1)
    spread = truth.std()
    assert ((found.mean(0) - truth.mean(0)) / spread).abs().max() < 0.1
    assert ((torch.cov(found.T) - torch.cov(truth.T, correction=0)) / spread**2).abs().max() < 0.2


def test_pca_n_of_one_component_samples_a_line(dataset):
    samples = PcaN(components=1).fit(dataset, seed=0).sample(50, seed=1)
    assert np.linalg.matrix_rank(samples - dataset.weights.numpy().mean(0), tol=1e-2) == 1


def test_nulls_are_what_their_names_say(dataset):
    weights = dataset.weights
    copies = torch.from_numpy(Copies().fit(dataset, 0).sample(40, seed=1))
    assert (copies[:, None] == weights).all(-1).any(1).all()
    noisy = torch.from_numpy(NoisyCopies(noise=0.1).fit(dataset, 0).sample(40, seed=1))
    assert torch.cdist(noisy, weights).min(1).values.mean().item() == pytest.approx(0.1 * SIZE**0.5, rel=0.1)
    between = Interpolations().fit(dataset, 0).sample(400, seed=1)
    assert between.std() < 0.9 * weights.numpy().std()


def test_merl100_sees_unpermuted_sources_only(dataset):
    config = {"network": {"width": 16, "depth": 1}, "components": 3, "steps": 3, "batch": 8}
    measured = dataset.subset(dataset.is_source & (dataset.permutation == 0))
    assert len(measured.weights) == 5
    assert torch.equal(Merl100(**config).fit(dataset, 0).draw(2, 1), Merl100(**config).fit(measured, 0).draw(2, 1))
