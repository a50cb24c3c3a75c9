import errno

import numpy as np
import pytest
import torch

from neumat.errors import NeumatError
from neumat.files import atomic_path
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


def test_seeds_depend_on_seed_and_name_only():
    assert seed_for(0, "blends") == seed_for(0, "blends") != seed_for(0, "folds")
    assert 0 <= seed_for("any", 7) < 2**63
    np.testing.assert_array_equal(numpy_generator(1, "a").random(3), numpy_generator(1, "a").random(3))
    assert torch.equal(
        torch.rand(3, generator=torch_generator(1, "a")), torch.rand(3, generator=torch_generator(1, "a"))
    )
