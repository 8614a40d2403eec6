from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from groma.errors import UserError
from groma.io.trajectory import read_kitti, read_tum, write_kitti, write_tum

STAMPS = np.array([976052905.167303, 976052905.267304, 976052906.0])
POSES = np.array([[0.0, 0.0, 0.0], [1.25, -2.5, 3.1], [-100.125, 7.0, -3.1]])


def test_tum_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "t.tum"
    write_tum(path, STAMPS, POSES)
    read = read_tum(path)
    np.testing.assert_allclose(read.stamps, STAMPS, atol=1e-6, rtol=0)
    np.testing.assert_allclose(read.poses, POSES, atol=3e-9)
    assert (read.skipped, read.repeated) == (0, 0)


def test_tum_is_what_strict_readers_accept(tmp_path: Path) -> None:
    path = tmp_path / "t.tum"
    write_tum(path, np.array([1.5]), np.array([[-0.0, 2.0, np.pi]]))
    assert (
        path.read_bytes()
        == b"1.500000000 0.000000000 2.000000000 0.000000000 0.000000000 0.000000000 1.000000000 0.000000000\n"
    )


def test_tum_refuses_to_write_what_nobody_could_read(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="NaN"):
        write_tum(tmp_path / "t.tum", np.array([1.0]), np.array([[np.nan, 0.0, 0.0]]))
    assert not list(tmp_path.iterdir())


def test_tum_reads_any_order_comments_commas_gzip_and_counts_what_it_leaves_out(tmp_path: Path) -> None:
    path = tmp_path / "t.tum.gz"
    text = """# stamp x y z qx qy qz qw
        3, 3, 0, 0, 0, 0, 0, 1
        1 1 0 0 0 0 0 1 # a comment
        2 nan 0 0 0 0 0 1
        2.5 0 0 0 0 0 0 0
        1 9 9 9 0 0 0 1
    """
    path.write_bytes(gzip.compress(text.encode()))
    read = read_tum(path)
    assert read.stamps.tolist() == [1, 3]
    assert read.poses[:, 0].tolist() == [1, 3]
    assert (read.skipped, read.repeated) == (2, 1)


def test_tum_takes_the_yaw_of_a_pose_in_space(tmp_path: Path) -> None:
    path = tmp_path / "t.tum"
    path.write_text("1 0 0 5 0.5 0.5 0.5 0.5\n")  # 90 deg about (1, 1, 1): x goes to y
    assert read_tum(path).poses[0, 2] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no pose"),
        ("# only\n\n", "no pose"),
        ("1 0 0 0 0 0 0 1\n2 0 0\n", "t.tum:2: 3 columns, expected 8"),
        ("1 0 0 0 0 0 0 1\n\n3 0 x 0 0 0 0 1\n", "t.tum:3: not a number: 'x'"),
        ("1 nan 0 0 0 0 0 1\n", "no pose"),
    ],
)
def test_tum_names_the_fault(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "t.tum"
    path.write_text(text)
    with pytest.raises(UserError, match=message):
        read_tum(path)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    cut = tmp_path / "cut.gz"
    cut.write_bytes(gzip.compress(b"1 0 0 0 0 0 0 1\n" * 100)[:-9])
    for path, message in [(tmp_path / "none.tum", "No such file"), (tmp_path, "directory"), (cut, "cut short")]:
        with pytest.raises(UserError, match=message):
            read_tum(path)


def test_kitti_round_trip(tmp_path: Path) -> None:
    path, times = tmp_path / "k.txt", tmp_path / "times.txt"
    write_kitti(path, times, STAMPS, POSES)
    read = read_kitti(path, times)
    np.testing.assert_allclose(read.stamps, STAMPS, atol=1e-6, rtol=0)
    np.testing.assert_allclose(read.poses, POSES, atol=3e-9)
    assert len(path.read_text().splitlines()[0].split(" ")) == 12


def test_kitti_needs_as_many_stamps_as_poses(tmp_path: Path) -> None:
    path, times = tmp_path / "k.txt", tmp_path / "times.txt"
    write_kitti(path, times, STAMPS, POSES)
    times.write_text("1\n2\n")
    with pytest.raises(UserError, match="2 stamps for the 3 poses"):
        read_kitti(path, times)
    times.write_text("1\n1\n2\n")
    with pytest.raises(UserError, match="stamps must grow"):
        read_kitti(path, times)
