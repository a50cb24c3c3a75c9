import struct

import numpy as np
import pytest

from neumat.brdf.coordinates import ENTRIES
from neumat.brdf.merl import BYTES, check_merl, read_folder, read_merl, write_merl
from neumat.errors import NeumatError
from neumat.seeds import numpy_generator


@pytest.fixture(scope="module")
def table():
    values = numpy_generator(0, "merl").gamma(1.0, 0.3, (ENTRIES, 3)).astype(np.float32)
    values[::5] = np.nan
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
    assert np.isnan(values[100:103]).all() and np.isfinite(np.delete(values, range(100, 103), axis=0)).all()
    assert (values[200] == 0).all()


def test_nan_is_written_as_minus_one(tmp_path, table):
    write_merl(tmp_path / "a.binary", table)
    raw = np.fromfile(tmp_path / "a.binary", "<f8", offset=12).reshape(3, -1)
    assert (raw[:, ::5] == -1).all() and (raw >= -1).all()


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
    assert_one_line(path, "negative values in every entry")
    for broken in (np.nan, np.inf):
        good[1, 17] = broken
        write_raw(path, good)
        assert_one_line(path, "1 that are NaN or infinite")


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
