"""Trajectory files, to the nanosecond and with their faults."""
import numpy
import pytest

from rio_t import tum
from rio_t.errors import RioTError

POSE = " 1 2 3 0 0 0 1\n"


@pytest.mark.parametrize("text, nanoseconds", [
    ("1700000000.123456789", 1700000000123456789),
    ("1700000000.5", 1700000000500000000),
    ("1.7000000001234567e9", 1700000000123456700),
    ("-0.25", -250000000),
    ("3", 3000000000)])
def test_stamps_are_exact(tmp_path, text, nanoseconds):
    path = tmp_path / "trajectory.txt"
    path.write_text(text + POSE)
    assert tum.read(path).stamp.tolist() == [nanoseconds]


def test_comments_and_empty_lines_are_no_poses(tmp_path):
    path = tmp_path / "trajectory.txt"
    path.write_text("# stamp x y z qx qy qz qw\n\n5" + POSE)
    trajectory = tum.read(path)
    assert trajectory.seconds(4 * 10**9).tolist() == [1.0]
    assert trajectory.position.tolist() == [[1, 2, 3]]
    assert trajectory.quaternion.tolist() == [[0, 0, 0, 1]]


def test_an_empty_file_has_no_pose(tmp_path):
    path = tmp_path / "trajectory.txt"
    path.write_text("# nothing\n")
    trajectory = tum.read(path)
    assert (len(trajectory), trajectory.position.shape, trajectory.quaternion.shape) == (0, (0, 3), (0, 4))


@pytest.mark.parametrize("line", ["5 1 2 3 0 0 0", "5 1 2 3 0 0 0 1 9", "five" + POSE, "5 1 2 x 0 0 0 1", "nan" + POSE,
                                  "inf" + POSE, "1e99" + POSE, "5 1 2 3 0 0 0 0", "\xff\xfe"])
def test_a_broken_line_is_named(tmp_path, line):
    path = tmp_path / "trajectory.txt"
    path.write_text("4" + POSE + line, encoding="latin-1")
    with pytest.raises(RioTError, match=r"trajectory.txt:2: expected `stamp x y z qx qy qz qw`"):
        tum.read(path)


def test_what_is_written_reads_back(tmp_path):
    path = tmp_path / "trajectory.txt"
    written = tum.Trajectory(numpy.array([1700000000000000001, 1700000000123456789]),
                             numpy.array([[1.0, -2.0, 0.125], [4.0, 5.0, 6.0]]),
                             numpy.array([[0.0, 0.6, 0.0, 0.8], [0.0, 0.0, 0.0, 1.0]]))
    tum.write(path, written)
    read = tum.read(path)
    assert read.stamp.tolist() == written.stamp.tolist()
    numpy.testing.assert_allclose(read.position, written.position, atol=1e-9)
    numpy.testing.assert_allclose(read.quaternion, written.quaternion, atol=1e-9)
    assert read[1:].positions().keys() == {1700000000123456789}
