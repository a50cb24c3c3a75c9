import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from neumat.brdf.names import check_name, check_names, measured_files
from neumat.errors import NeumatError

LETTERS = string.ascii_letters + string.digits + " _.-+()[]#%&'\"=,;é漢*?!$~"


@given(st.text(LETTERS, min_size=1, max_size=40))
def test_what_a_file_can_be_called_is_accepted(name):
    name = name.strip().strip(".").strip() or "x"
    if not name.lower().startswith(("sample-", "blend-")):
        check_name(name, "here")


@pytest.mark.parametrize(
    "name",
    [
        "", ".", "..", ".hidden", " a", "a ", "a\tb", "a\nb", "a\rb", "a\u2028b", "a\x00b", "a\u200bb", "caf\udce9",
        "steel@rbg", "@", "a/b", "../x", "a\\b", "{material}", "a}", "x" * 201, "漢" * 80,
        "sample-0", "Sample-12", "blend-000", "BLEND-7", "sample-٣",
    ],
)  # fmt: skip
def test_what_collides_or_could_not_come_back_is_refused_in_one_line(tmp_path, name):
    with pytest.raises(NeumatError) as caught:
        check_name(name, f"folder/{name}.binary")
    message = str(caught.value)
    assert len(message.splitlines()) == 1 and "rename" in message and message.isprintable()


@pytest.mark.parametrize(
    "name", ["blend-red", "sample", "samples", "sample-a", "blend", "001", "NA", "nan", "1e5", "-"]
)
def test_names_that_only_look_special_are_accepted(name):
    check_name(name, "here")


def test_names_that_differ_in_case_are_refused():
    with pytest.raises(NeumatError, match="rename one"):
        check_names(["Steel", "felt", "steel"], "here")
    with pytest.raises(NeumatError, match="rename one"):
        check_names(["steel"] * 2, "here")


def test_a_folder_says_which_file_to_rename(tmp_path):
    (tmp_path / "steel@rbg.bsdf").touch()
    with pytest.raises(NeumatError, match=r"steel@rbg\.bsdf: expected a name .*rename it"):
        measured_files(tmp_path, ".bsdf")
    (tmp_path / "steel@rbg.bsdf").rename(tmp_path / "steel.v1.bsdf")
    (tmp_path / "002.BSDF").touch()
    assert list(measured_files(tmp_path, ".bsdf")) == ["002", "steel.v1"]


def test_a_folder_whose_path_is_too_long_is_none():
    with pytest.raises(NeumatError, match="no such folder"):
        measured_files("x" * 5000, ".bsdf")
