import pytest
import torch

from neumat.brdf.analytic import GGX, Lambert
from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles
from neumat.errors import NeumatError
from neumat.fields.field import evaluate
from neumat.fields.layout import SIZE
from neumat.render.scene import to_srgb8
from neumat.render.sphere import FrozenSphere
from neumat.render.tables import radiance_tables, render_combinations, render_tables, table_matrix
from neumat.seeds import torch_generator


@pytest.fixture(scope="module")
def frozen():
    return FrozenSphere(32, rings=48, azimuths=64)


@pytest.fixture(scope="module")
def entries():
    return above_horizon().nonzero()[:, 0]


@pytest.fixture(scope="module")
def weights():
    return 0.3 * torch.randn(3, SIZE, generator=torch_generator(1, "test_tables"))


def columns(weights, entries):
    return evaluate(weights, *grid_angles(entries)).permute(1, 0, 2).reshape(len(entries), -1)


@pytest.mark.parametrize("material", [Lambert([0.8, 0.4, 0.1]), GGX(0.3, 0.8), GGX(0.1, [0.9, 0.6, 0.3])])
def test_a_table_of_a_smooth_material_has_its_picture(frozen, entries, material):
    matrix, used = table_matrix(frozen, entries)
    pictures = radiance_tables(frozen, matrix, material.eval(*grid_angles(entries[used])))
    direct = frozen.pictures(material.eval(frozen.theta_h, frozen.theta_d, frozen.phi_d).T[None])
    assert torch.allclose(pictures, direct, rtol=0.01, atol=1e-3)


def test_missing_entries_hand_their_weight_to_their_neighbours(frozen, entries):
    kept = entries[torch.rand(len(entries), generator=torch_generator(2, "missing")) > 0.3]
    matrix, used = table_matrix(frozen, kept)
    rows = (matrix @ torch.ones(len(used), 1))[:, 0]
    assert ((rows - 1).abs() < 1e-5).float().mean() > 0.99  # the rest have no neighbour left and are 0
    assert torch.all((rows == 0) | ((rows - 1).abs() < 1e-5))


def test_combinations_equal_the_pictures_of_combined_tables(frozen, entries, weights):
    matrix, used = table_matrix(frozen, entries)
    sources = columns(weights, entries[used])
    mix = torch.rand(4, 3, sources.shape[1], generator=torch_generator(3, "mix")) / 9
    combined = torch.einsum("uk,nck->unc", sources, mix).flatten(1)
    expected = render_tables(frozen, matrix, combined).int()
    found = render_combinations(frozen, matrix @ sources, mix).int()
    assert (found - expected).abs().max() <= 1


def test_negative_combinations_are_black(frozen, entries, weights):
    matrix, used = table_matrix(frozen, entries)
    values = matrix @ columns(weights, entries[used])
    picture = render_combinations(frozen, values, -torch.ones(1, 3, values.shape[1]))
    nothing = to_srgb8(frozen.pictures(torch.zeros(1, 3, len(values))))
    assert torch.equal(picture, nothing)


@pytest.mark.parametrize("bad", [[], [5, 5], [7, 3], [-1, 4], [0, ENTRIES]])
def test_entries_that_are_no_ascending_grid_indices_are_refused(frozen, bad):
    with pytest.raises(NeumatError, match="ascending"):
        table_matrix(frozen, bad)
