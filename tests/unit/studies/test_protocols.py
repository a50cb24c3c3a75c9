import numpy as np

from neumat.brdf.coordinates import GRID
from neumat.studies.protocols import coarse_positions


def flat(*index):
    return np.ravel_multi_index(index, GRID)


def test_a_coarse_table_is_read_at_its_lower_entry():
    entries = np.array([flat(0, 0, 0), flat(0, 0, 1), flat(2, 4, 6), flat(3, 5, 7), flat(5, 5, 5)])
    assert coarse_positions(entries, 2).tolist() == [0, 0, 2, 2, 4]  # (4, 4, 4) is invalid: the entry itself
    assert coarse_positions(entries, 1).tolist() == [0, 1, 2, 3, 4]
