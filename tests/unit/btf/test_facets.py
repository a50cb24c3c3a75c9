"""Materials of facets, by name and by file."""

import pandas as pd
import pytest
import torch

from neumat.brdf.coordinates import grid_angles
from neumat.brdf.embedded import Embedded, embedded_names, embedded_table
from neumat.brdf.merl import write_merl
from neumat.btf.facets import facet_material
from neumat.errors import NeumatError
from neumat.export.npy import write_npy
from neumat.fields.field import Field
from neumat.fields.store import PER_MATERIAL, write_neumerl


@pytest.fixture
def angles():
    return grid_angles(torch.tensor([100, 90 * 180 * 20 + 180 * 30 + 60, 90 * 180 * 45 + 180 * 5 + 90]))


def test_embedded_material_is_found_by_its_name(angles):
    found = facet_material("red-phenolic").eval(*angles)
    assert torch.allclose(found, Embedded(embedded_names().index("red-phenolic")).eval(*angles), rtol=1e-3)


def test_table_and_field_are_read_from_files(tmp_path, angles, lambert):
    write_merl(tmp_path / "a.binary", embedded_table(0))
    assert torch.allclose(
        facet_material(str(tmp_path / "a.binary")).eval(*angles), facet_material(embedded_names()[0]).eval(*angles)
    )
    weights = lambert(0.5)[0]
    write_npy(tmp_path / "b_fc1.npy", weights, {})
    found = facet_material(str(tmp_path / "b_fc1.npy")).eval(*angles)
    assert torch.allclose(found, Field(weights).eval(*angles), rtol=1e-4)


def test_field_of_a_store_is_found_by_its_name(tmp_path, angles, lambert):
    manifest = pd.DataFrame(
        {"name": ["a"], "base": [0], "permutation": ["rgb"], "parent_a": ["a"], "parent_b": ["a"], "weight": [1.0]}
    )
    write_neumerl(tmp_path / "a.h5", manifest, lambert(0.5), {key: [0] for key in PER_MATERIAL}, {})
    found = facet_material("a", tmp_path / "a.h5").eval(*angles)
    assert torch.allclose(found, torch.tensor(0.5 / torch.pi), rtol=1e-4)
    with pytest.raises(NeumatError, match="b"):
        facet_material("b", tmp_path / "a.h5")


@pytest.mark.parametrize("name", ["no-such-material", "no/such/file.binary"])
def test_what_is_neither_name_nor_file_is_refused(name):
    with pytest.raises(NeumatError, match=name.split("/")[0]):
        facet_material(name)
