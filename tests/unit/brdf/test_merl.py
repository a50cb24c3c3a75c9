import struct

import numpy as np
import pytest

from neumat.brdf.coordinates import ENTRIES, above_horizon
from neumat.brdf.merl import BYTES, SCALE, check_merl, read_folder, read_merl, write_merl
from neumat.errors import NeumatError
from neumat.export import read_material
from neumat.seeds import numpy_generator


@pytest.fixture(scope="module")
def table():
    values = numpy_generator(0, "merl").gamma(1.0, 0.3, (ENTRIES, 3)).astype(np.float32)
    values[::5] = np.nan
    values[~above_horizon()] = np.nan
    return values


def write_raw(path, raw):
    """Write raw units (3, entries) as the format's description has it, independently of write_merl."""
    path.write_bytes(struct.pack("<3i", 90, 90, 180) + raw.astype("<f8").tobytes())


def assert_one_line(path, *words, read=read_merl):
    with pytest.raises(NeumatError) as caught:
        read(path)
    message = str(caught.value)
    assert "\n" not in message and path.name in message
    for word in words:
        assert word in message


def test_round_trip(tmp_path, table):
    path = tmp_path / "a.binary"
    write_merl(path, table)
    assert path.stat().st_size == BYTES == 34_992_012
    np.testing.assert_allclose(read_merl(path), table, rtol=1e-6)


def test_scale_order_and_mask(tmp_path):
    raw = np.ones((3, ENTRIES)) * 1500
    index = 7 + 180 * (5 + 90 * 3)  # theta_h 3, theta_d 5, phi_d 7
    raw[:, index] = [3000, 1500, 150]
    for channel in range(3):  # negative in a single channel is invalid in all
        raw[channel, 100 + channel] = -1e-9
    raw[:, 200] = 0  # black is valid
    write_raw(tmp_path / "a.binary", raw)
    values = read_merl(tmp_path / "a.binary")
    assert values.dtype == np.float32
    np.testing.assert_allclose(values[index], [2, 1.15, 0.166], rtol=1e-6)
    up = above_horizon().numpy()
    up[100:103] = False
    assert np.isnan(values[~up]).all() and np.isfinite(values[up]).all()
    assert (values[200] == 0).all()


def test_nan_is_written_as_minus_one(tmp_path, table):
    write_merl(tmp_path / "a.binary", table)
    raw = np.fromfile(tmp_path / "a.binary", "<f8", offset=12).reshape(3, -1)
    assert (raw[:, ::5] == -1).all() and (raw[:, ~above_horizon().numpy()] == -1).all() and (raw >= -1).all()


def test_bad_files(tmp_path):
    good = np.full((3, ENTRIES), 10.0)
    path = tmp_path / "a.binary"
    assert_one_line(path, "no such file")
    path.write_bytes(b"")
    assert_one_line(path, "0 bytes")
    path.write_text("a text that someone renamed")
    assert_one_line(path, "not a MERL file")
    path.write_bytes(struct.pack("<3i", 90, 90, 360) + bytes(100))
    assert_one_line(path, "(90, 90, 360)", "(90, 90, 180)")
    write_raw(path, good[:, :-1])
    assert_one_line(path, "truncated", str(BYTES))
    path.write_bytes(struct.pack("<3i", 90, 90, 180) + bytes(BYTES))
    assert_one_line(path, "too long")
    write_raw(path, -good)
    assert_one_line(path, "above the horizon", "0.0%")
    path.unlink()
    path.mkdir()
    assert_one_line(path, "a folder")


@pytest.mark.parametrize("below", [-1.0, 0.0, 1e5, np.nan, np.inf])
def test_what_lies_below_the_horizon_does_not_count(tmp_path, below):
    raw = np.full((3, ENTRIES), 10.0)
    up = above_horizon().numpy()
    raw[:, ~up] = below
    write_raw(tmp_path / "a.BINARY", raw)
    values = read_material(tmp_path / "a.BINARY")
    np.testing.assert_array_equal(values.valid, up)
    assert list(read_folder(tmp_path)) == ["a"]


@pytest.mark.parametrize("broken", [np.nan, np.inf, -1.0, 1e300])  # the last is infinite in single precision
def test_half_of_the_entries_above_the_horizon_make_a_file(tmp_path, broken):
    up = np.flatnonzero(above_horizon())
    for share, accepted in ((0.49, True), (0.51, False)):
        raw = np.full((3, ENTRIES), 10.0)
        raw[1, up[: int(share * len(up))]] = broken
        write_raw(tmp_path / "a.binary", raw)
        if accepted:
            assert np.isfinite(read_merl(tmp_path / "a.binary")).all(1).sum() == len(up) - int(share * len(up))
        else:
            assert_one_line(tmp_path / "a.binary", "50%", "49.0%")


def test_other_orders_of_the_same_numbers_are_refused(tmp_path, table):
    """Interleaved channels, big-endian numbers: of the right size, and of few valid entries."""
    raw = np.where(np.isnan(table), -1.0, table / SCALE).T
    for other in (np.ascontiguousarray(raw.T).reshape(3, -1), raw.byteswap().view("<f8")):
        write_raw(tmp_path / "a.binary", other)
        assert_one_line(tmp_path / "a.binary", "above the horizon")


def test_writing_a_wrong_shape_leaves_nothing(tmp_path):
    assert_one_line(tmp_path / "a.binary", "(10, 3)", read=lambda path: write_merl(path, np.ones((10, 3))))
    assert not list(tmp_path.iterdir())


def test_folder(tmp_path):
    folder = tmp_path / "measured"
    assert_one_line(folder, "no such folder", read=read_folder)
    folder.mkdir()
    assert_one_line(folder, "empty", read=read_folder)
    for name in ("b.binary", "A.binary"):
        write_raw(folder / name, np.ones((3, ENTRIES)))
    (folder / ".hidden").touch()
    assert list(read_folder(folder)) == ["A", "b"]
    assert read_folder(folder)["b"] == folder / "b.binary"
    (folder / "B.binary").hardlink_to(folder / "A.binary")
    with pytest.raises(NeumatError, match=r"b\.binary.*B\.binary too"):
        read_folder(folder)
    (folder / "B.binary").unlink()
    (folder / "notes.txt").touch()
    with pytest.raises(NeumatError, match=r"notes\.txt.*another kind"):
        read_folder(folder)
    (folder / "notes.txt").rename(folder / "notes.binary")
    with pytest.raises(NeumatError, match=r"notes\.binary"):
        read_folder(folder)
    check_merl(folder / "b.binary")
