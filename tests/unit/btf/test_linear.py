"""Interpolation over directions, principal components and spherical harmonics, against closed forms."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.btf.directions import random_directions, spherical, ubo2003_directions, ubo2014_directions
from neumat.btf.representations.grid import Triangles, regular_grid
from neumat.btf.representations.linear import Pca, SphericalHarmonics, harmonics
from neumat.btf.store import BtfStore
from neumat.errors import NeumatError
from neumat.seeds import torch_generator

GRID = ubo2003_directions()[::3]


def pictures(values):
    """Return a store of values (V, L, H, W, 3) of the views and lights of GRID, in random order."""
    order = torch.randperm(len(GRID) ** 2, generator=torch_generator(0, "order"))
    light, view = GRID.repeat(len(GRID), 1)[order, None], GRID.repeat_interleave(len(GRID), 0)[order, None]
    return BtfStore.from_arrays(values.flatten(0, 1)[order], light, view, kind="pictures")


def test_a_grid_is_found_in_any_order():
    values = torch.rand(len(GRID), len(GRID), 2, 2, 3, generator=torch_generator(0, "values"))
    store = pictures(values)
    views, lights, sweeps = regular_grid(store, "test")
    assert sweeps.shape == (len(GRID), len(GRID))
    assert torch.equal(store.view[sweeps, 0], views[:, None].expand(-1, len(lights), -1))
    assert torch.equal(store.light[sweeps, 0], lights[None].expand(len(views), -1, -1))


@pytest.mark.parametrize("directions", [ubo2003_directions(), ubo2014_directions()], ids=["81", "151"])
def test_nodes_of_a_triangulation_are_met_exactly(directions):
    index, weight = Triangles(directions)(directions)
    found = torch.zeros(len(directions), len(directions)).scatter_add_(1, index, weight)
    assert torch.allclose(found, torch.eye(len(directions)), atol=1e-5)


@settings(max_examples=50, deadline=None)
@given(st.floats(0, math.pi / 2), st.floats(-7, 7))
def test_weights_are_a_partition_near_the_direction(theta, phi):
    directions = ubo2003_directions()
    query = spherical(torch.tensor([theta]), torch.tensor([phi]))
    index, weight = Triangles(directions)(query)
    assert (weight >= 0).all() and weight.sum().item() == pytest.approx(1, abs=1e-6)
    distance = torch.acos((directions[index[0]] @ query[0]).clamp(-1, 1))[weight[0] > 0]
    assert distance.max() < math.radians(22 if theta < math.radians(75) else 32)


def test_too_few_directions_are_refused():
    with pytest.raises(NeumatError, match="at least three"):
        Triangles(GRID[:2])


def test_pca_is_exact_for_a_table_of_its_rank():
    generator = torch_generator(0, "low rank")
    coefficients = torch.rand(len(GRID), len(GRID), 3, 3, generator=generator)
    components = torch.rand(3, 3, 16, generator=generator)  # of channels: three of texels
    values = torch.einsum("vlcr,crt->vltc", coefficients, components).view(len(GRID), len(GRID), 4, 4, 3)
    fitted = Pca(components=3, curve=0.0).fit(pictures(values), seed=0)
    for v, k in ((0, 0), (3, 7), (26, 11)):
        assert torch.allclose(fitted.picture(GRID[k], GRID[v]), values[v, k], atol=5e-3)


def test_harmonics_are_orthonormal():
    directions = torch.nn.functional.normalize(
        torch.randn(400_000, 3, generator=torch_generator(0, "sphere"), dtype=torch.float64), dim=1
    )
    basis = harmonics(directions)
    assert torch.allclose(4 * math.pi * basis.T @ basis / len(basis), torch.eye(9).double(), atol=0.03)


def test_harmonics_fit_what_they_span():
    """Values that are a quadratic polynomial of the light, for each view and texel another."""
    generator = torch_generator(0, "quadratic")
    weights = torch.rand(len(GRID), 4, 4, 3, 4, generator=generator)
    x, y, z = GRID.T
    functions = torch.stack([z, 1 + x, 1 + x * y, z * z], 1)
    values = torch.einsum("vhwcf,lf->vlhwc", weights, functions)
    fitted = SphericalHarmonics(regularisation=1e-6, curve=0.0).fit(pictures(values), seed=0)
    light = random_directions(1, torch_generator(1, "light"), math.radians(70))[0]
    x, y, z = light
    expected = torch.einsum("hwcf,f->hwc", weights[5], torch.stack([z, 1 + x, 1 + x * y, z * z]))
    assert torch.allclose(fitted.picture(light, GRID[5]), expected, rtol=0.02)


@pytest.mark.parametrize("method", [Pca(), SphericalHarmonics()], ids=["pca", "sh"])
def test_features_beyond_the_fitted_give_nothing_brighter_than_the_brightest(method):
    values = torch.rand(len(GRID), len(GRID), 4, 4, 3, generator=torch_generator(0, "values"))
    fitted = method.fit(pictures(values), seed=0)
    features = fitted.positional().flatten(0, 1).repeat(len(GRID), 1)
    found = fitted.eval(20 * features, GRID.repeat_interleave(16, 0), GRID[:1])
    assert found.max().item() == pytest.approx(values.max().item(), rel=1e-3)
