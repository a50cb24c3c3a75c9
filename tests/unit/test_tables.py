import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from neumat.augment.manifest import draw_manifest, protocol_indices, read_manifest
from neumat.tables import NAMES, read_table

CONFIG = {"blends": 4, "held_out": 0.2, "weight_range": [0.3, 0.7]}
ODD = [
    "001",
    "NA",
    "nan",
    "null",
    "None",
    "1e5",
    "1_000",
    "True",
    "inf",
    "-0",
    "0x1F",
    "a,b",
    'q"q',
    "#x",
    "1.0",
    "N/A",
]


@pytest.mark.parametrize("suffix", ["tsv", "csv"])
@given(names=st.lists(st.sampled_from(ODD) | st.text("abc01 .,'\"#;", max_size=6), min_size=1, max_size=8))
def test_names_come_back_letter_for_letter_and_numbers_as_numbers(tmp_path_factory, suffix, names):
    path = tmp_path_factory.mktemp("tables") / f"x.{suffix}"
    for column in NAMES[:6]:
        table = pd.DataFrame({column: names, "value": [0.5] * len(names), "none": [None] * len(names)})
        table.to_csv(path, sep="\t" if suffix == "tsv" else ",", index=False)
        back = read_table(path)
        assert list(back[column]) == names
        assert (back["value"] == 0.5).all() and back["none"].isna().all()


@pytest.mark.parametrize(
    "names", [ODD[:6], [str(i) for i in range(5)], ["007", "08", "9", "1e3"], ["NA", "nan", "a", "b"]]
)
def test_a_manifest_comes_back_as_it_was_written(tmp_path, names):
    made = draw_manifest(names, CONFIG, 0)
    made.to_csv(tmp_path / "manifest.tsv", sep="\t", index=False)
    back = read_manifest(tmp_path / "manifest.tsv")
    pd.testing.assert_frame_equal(back, made, check_dtype=False)
    for protocol in ("parity", "grouped", *(f"fold{k}" for k in range(min(5, len(names))))):
        for ours, theirs in zip(protocol_indices(back, protocol), protocol_indices(made, protocol), strict=True):
            assert list(ours) == list(theirs) and len(ours)
