from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from neumat.brdf.embedded import embedded_names
from neumat.brdf.types import read_types, type_names, type_rows
from neumat.errors import NeumatError

TYPES = Path(__file__).parents[3] / "config" / "types.tsv"


def test_every_measured_material_has_one_of_the_papers_48_types():
    types = read_types(TYPES)
    assert set(types.index) == set(embedded_names())
    sources = pd.DataFrame({"parent_a": embedded_names(), "parent_b": embedded_names()})
    assert len(type_names(sources, types)) == 48
    assert (types != "").all(axis=None)


def test_blends_carry_both_types_and_unknown_materials_none():
    types = read_types(TYPES)
    manifest = pd.DataFrame(
        {
            "parent_a": ["chrome", "chrome", "red-fabric", "my-paint"],
            "parent_b": ["chrome", "red-fabric", "blue-fabric", "my-paint"],
        }
    )
    rows = type_rows(manifest, types)
    chrome, fabric = (type_names(manifest, types).index(name) for name in ("chrome", "fabric"))
    assert rows.sum(1).tolist() == [1, 1, 1, 0]
    assert type_names(manifest, types) == ["chrome", "fabric"]
    assert rows[0, chrome] == 1 and rows[2, fabric] == 1
    assert rows[1, [chrome, fabric]].tolist() == [0.5, 0.5]
    assert rows.dtype == np.float32


def test_no_type_is_known_of_sources_that_the_table_does_not_name():
    manifest = pd.DataFrame({"parent_a": ["001", "NA"], "parent_b": ["001", "NA"]})
    assert type_names(manifest, read_types(TYPES)) == [] and type_rows(manifest, read_types(TYPES)).shape == (2, 0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("name\ttype\na\tb\n", "columns name, type, family, description"),
        ("name\ttype\tfamily\tdescription\na\tb\tc\td\na\tb\tc\td\n", "each material once"),
    ],
)
def test_a_wrong_table_ends_in_one_line(tmp_path, text, expected):
    path = tmp_path / "types.tsv"
    path.write_text(text)
    with pytest.raises(NeumatError, match=expected):
        read_types(path)
    with pytest.raises(NeumatError, match="table of material types"):
        read_types(tmp_path / "missing.tsv")
