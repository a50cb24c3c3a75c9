import errno
import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import torch
from safetensors.numpy import save_file

from neumat.errors import NeumatError
from neumat.files import atomic_path, cause, read_store
from neumat.seeds import numpy_generator, seed_for, torch_generator


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    target = tmp_path / "deep" / "file.txt"
    with atomic_path(target) as path:
        path.write_text("whole")
        assert not target.exists()
    assert target.read_text() == "whole"
    with pytest.raises(ValueError), atomic_path(target) as path:
        path.write_text("half")
        raise ValueError
    assert target.read_text() == "whole"
    assert list(target.parent.iterdir()) == [target]


@pytest.mark.parametrize(
    "error", [OSError(errno.ENOSPC, "No space left on device"), OSError("Can't write data (No space left on device)")]
)
def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path, error):
    with pytest.raises(NeumatError, match="room on the disk") as caught, atomic_path(tmp_path / "store.h5") as path:
        path.write_bytes(b"half")
        raise error
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_what_is_written_has_the_mode_that_the_umask_leaves(tmp_path, mask):
    before = os.umask(mask)
    try:
        with atomic_path(tmp_path / "a.safetensors") as path:
            save_file({"x": np.zeros(1)}, path)  # which makes files of mode 0600
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a.safetensors").stat().st_mode) == 0o666 & ~mask


def test_a_place_where_nothing_can_be_written(tmp_path):
    (tmp_path / "file").touch()
    for path in (tmp_path, tmp_path / "file" / "x.h5", tmp_path / ("x" * 300)):
        with pytest.raises(NeumatError, match="a place to write a file; found"), atomic_path(path):
            raise AssertionError("begun")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.fixture
def numbers(tmp_path):
    with h5py.File(tmp_path / "store.h5", "w") as file:
        file["x"], file["name"] = np.zeros((4, 3)), list("abcd")
        file.attrs["schema_version"] = 2
    return tmp_path / "store.h5"


MEMBERS = {"x": ("numbers", ("n", 3)), "name": ("text", ("n",))}


def assert_refused(path, words):
    with pytest.raises(NeumatError) as caught:
        read_store(path, "a store of numbers", MEMBERS, 2)
    assert words in str(caught.value) and "\n" not in str(caught.value), str(caught.value)


def test_a_store_is_what_its_reader_says(numbers):
    arrays, attributes = read_store(numbers, "a store of numbers", MEMBERS, 2)
    assert arrays["x"].shape == (4, 3) and list(arrays["name"]) == list("abcd") and attributes == {"schema_version": 2}
    for change, words in [
        ({"x": np.zeros((4, 2))}, "x of shape (4, 3); found shape (4, 2)"),
        ({"x": np.zeros((5, 3))}, "name of shape (5); found shape (4,)"),
        ({"x": np.zeros((4, 3), int)}, "numbers in x; found int64"),
        ({"x": np.full((4, 3), np.inf)}, "finite numbers in x"),
        ({"name": np.zeros(4)}, "text in name; found float64"),
        ({"name": h5py.Empty("f")}, "text in name"),
        ({"x": None}, "another kind of store (no dataset x)"),
        ({"x": "group"}, "another kind of store (no dataset x)"),
        ({"version": 3}, "of schema version 2; found version 3"),
        ({"version": [2, 2]}, "a damaged or foreign file"),
    ]:
        changed = shutil.copy(numbers, numbers.with_name("changed.h5"))
        with h5py.File(changed, "r+") as file:
            for key, value in change.items():
                if key == "version":
                    file.attrs["schema_version"] = value
                    continue
                del file[key]
                if isinstance(value, str):
                    file.create_group(key)
                elif value is not None:
                    file[key] = value
        assert_refused(changed, words)


def test_what_cannot_be_read_says_why(numbers, tmp_path):
    assert_refused(tmp_path / "none.h5", "found no such file")
    assert_refused(tmp_path, "found a folder")
    assert_refused(numbers / "below.h5", "found no such file")
    (tmp_path / "text.h5").write_text("text")
    assert_refused(tmp_path / "text.h5", "found a damaged or foreign file")
    (tmp_path / "half.h5").write_bytes(numbers.read_bytes()[:900])
    assert_refused(tmp_path / "half.h5", "found a damaged or foreign file")
    code = f"import h5py; file = h5py.File({str(numbers)!r}, 'r+'); print(flush=True); input()"
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        holder.stdout.readline()
        assert_refused(numbers, "found a file in use by another program")
        holder.communicate(b"\n")


def test_a_forbidden_file_is_not_called_damaged(numbers, monkeypatch):
    """Root may read any file, so the system's refusal is put in its place."""

    def refuse(path, mode):
        raise PermissionError(13, "Permission denied", path)

    monkeypatch.setattr(Path, "open", refuse)
    for error in (FileNotFoundError("as safetensors says it"), OSError("as h5py says it")):
        assert cause(numbers, error) == "a file that may not be read (permission denied)"


def test_seeds_depend_on_seed_and_name_only():
    assert seed_for(0, "blends") == seed_for(0, "blends") != seed_for(0, "folds")
    assert 0 <= seed_for("any", 7) < 2**63
    np.testing.assert_array_equal(numpy_generator(1, "a").random(3), numpy_generator(1, "a").random(3))
    assert torch.equal(
        torch.rand(3, generator=torch_generator(1, "a")), torch.rand(3, generator=torch_generator(1, "a"))
    )
