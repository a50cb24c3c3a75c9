import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.decomposition import PCA

from neumat.augment.pca import permuted_rows, projection


def random_columns(n, entries, seed):
    return np.random.default_rng(seed).lognormal(size=(3 * n, entries))


@settings(max_examples=10)
@given(n=st.integers(2, 5), components=st.integers(1, 8), seed=st.integers(0, 99))
def test_projection_is_that_of_an_ordinary_pca(n, components, seed):
    columns = random_columns(n, 40, seed)
    coefficients, _ = projection(columns @ columns.T, components)
    materials = columns[permuted_rows(n)].reshape(6 * n, -1)
    pca = PCA(min(components, 5 * n - 1)).fit(materials)
    # The permuted materials span pairs of equal variance: a cut through a pair has no unique answer.
    values = PCA().fit(materials).explained_variance_
    if components < len(values) and np.isclose(values[components - 1], values[components], rtol=1e-6):
        return
    expected = pca.inverse_transform(pca.transform(materials))[::6].reshape(3 * n, -1)
    np.testing.assert_allclose(coefficients @ columns, expected, atol=1e-6)


def test_all_components_change_nothing():
    columns = random_columns(4, 200, 1)
    coefficients, kept = projection(columns @ columns.T, 300)
    np.testing.assert_allclose(coefficients @ columns, columns, rtol=1e-6)
    assert kept == 1
