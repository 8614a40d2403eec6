from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made import Ros, bag1, drive_entries, drive_lines, read, refusal, text, texts

from groma.errors import UserError
from groma.io.recording import open_recording, write_recording
from groma.nouns.messages import LaserScan, Odometry

REFUSED = {
    "empty.log": (b"", "an empty file"),
    "picture.png": (b"\x89PNG\r\n\x1a\n" + bytes(100), "a PNG image"),
    "data.mat": (b"MATLAB 5.0 MAT-file" + bytes(100), "a MATLAB file"),
    "binary.log": (bytes(range(256)) * 10, "a binary file"),
    "a.rawlog": (b"\x8d\x0cCSensoryFrame\x02", "an MRPT rawlog"),
    "wean.log": (b"L -94.234001 -139.953995 -1.342158 -88.5\n", "Wean Hall"),
    "rover.dat": (b"212387282 14710 " + b"0 " * 700 + b"\n", "more than a hundred columns"),
    "graph.g2o": (b"VERTEX_SE2 0 0 0 0\n", "a pose graph"),
    "mrclam.dat": (b"# UTIAS Multi-Robot\n1 2\n", "MR.CLAM"),
    "ticks.tuple": (b'{ "T": 0.7 }\n', "JSON"),
    "pose.tum": (b"1.0 2.0 3.0 0 0 0 0 1\n", "a table of numbers"),
    "corners.csv": (b"image,corner\na.jpg,0\n", "a CSV table that is not groma's own"),
    "blank.log": (b"\n \n", "blank text"),
    "letter.txt": (b"Dear reader,\n", "text whose first line is 'Dear reader,'"),
    "old.bag": (b"#ROSBAG V1.2\n" + bytes(50), "version '1.2'"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_recording_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    data, told = REFUSED[name]
    (tmp_path / name).write_bytes(data)
    said = refusal(tmp_path / name)
    assert told in said
    assert "\n" not in said
    assert said.startswith(str(tmp_path / name))


def test_nothing_there(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        open_recording(tmp_path / "none.log")


def test_a_folder_that_is_no_bag(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no metadata\.yaml"):
        open_recording(tmp_path)


def test_a_gz_that_is_damaged_from_the_start(tmp_path: Path) -> None:
    (tmp_path / "a.log.gz").write_bytes(b"\x1f\x8b" + bytes(30))
    with pytest.raises(UserError, match="damaged"):
        open_recording(tmp_path / "a.log.gz")


def test_the_content_decides_and_not_the_name(tmp_path: Path) -> None:
    assert read(text(tmp_path / "a.txt", drive_lines(1)))[0].format == "CARMEN log"
    assert read(bag1(tmp_path / "b.bag", drive_entries(Ros(1), 2)).rename(tmp_path / "b.log"))[0].format == "ROS 1 bag"


def test_dpslam(tmp_path: Path) -> None:
    lines = [f"Odometry {0.1 * k} 0 0.5\nLaser 181 {'1.5 ' * 181}\n" for k in range(3)] + [
        "Laser 3 1 2\n",
        "Odometry 1\n",
    ]
    recording, messages = read(text(tmp_path / "a.log.gz", lines))
    assert recording.format == "DP-SLAM log"
    assert [(type(m), m.stamp) for m in messages] == [(t, float(k)) for k in range(3) for t in (Odometry, LaserScan)]
    assert messages[2] == Odometry(1.0, "Odometry", 0.1, 0.0, 0.5)
    assert recording.notes.malformed == 2
    assert any("no times" in line for line in texts(recording))


def test_only_some_suffixes_are_written(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"\.csv"):
        write_recording(tmp_path / "a.log", [])


def test_a_failed_write_leaves_what_was_there(tmp_path: Path) -> None:
    for name in ("a.csv", "a.mcap"):
        path = tmp_path / name
        path.write_text("before")

        def broken() -> object:
            yield Odometry(1.0, "odom", 0.0, 0.0, 0.0)
            raise UserError("stop")

        with pytest.raises(UserError, match="stop"):
            write_recording(path, broken())  # type: ignore[arg-type]
        assert path.read_text() == "before"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.csv", "a.mcap"]


def test_an_unwritable_place(tmp_path: Path) -> None:
    for name in ("a.csv", "a.mcap"):
        with pytest.raises(UserError, match="cannot be written"):
            write_recording(tmp_path / "none" / name, [])


SIDE_FILES = ("-shm", "-wal")
"""What SQLite leaves beside a database: no recordings of their own."""


@pytest.mark.shared
def test_every_shared_file_is_read_whole_or_refused_in_one_line(shared: Path) -> None:
    read_whole = refused = 0
    places = [
        path
        for path in sorted((shared / "data").rglob("*"))
        if (path.is_file() or (path / "metadata.yaml").exists()) and not path.name.endswith(SIDE_FILES)
    ]
    for path in places:
        if told := refusal(path):
            assert "\n" not in told
            assert "of a kind groma does not know" not in told
            refused += 1
            continue
        recording = open_recording(path)
        messages = sum(1 for _ in recording.messages())
        assert messages, path
        assert not recording.notes.malformed, (path, recording.notes.examples)
        assert not recording.notes.cut, path
        read_whole += 1
    assert read_whole >= 18
    assert refused > 100


@pytest.mark.shared
def test_shared_scan_counts_are_those_of_the_catalogue(shared: Path) -> None:
    catalogue = {
        "intel/derived/intel_raw3361.clf.gz": (3361, 180),
        "intel/intel-lab.flirt.log.gz": (2672, 180),
        "intel/intel.gfs.log.gz": (910, 180),
        "mit-csail/mit-csail.flaser.clf.gz": (1988, 361),
        "radish-corrected/orebro-corrected.log.gz": (237, 181),
        "radish-corrected/seattle-corrected.log.gz": (241, 361),
        "dpslam-loop5/loop5.log.gz": (551, 181),
        "bags/fuse_turtlebot3.bag": (457, 360),
        "bags/converted/tb3_sqlite3": (457, 360),
    }
    for name, (count, beams) in catalogue.items():
        scans = [m for m in open_recording(shared / "data" / name).messages() if isinstance(m, LaserScan)]
        assert (len(scans), len(scans[0].ranges)) == (count, beams), name
        assert not any(np.nanmax(s.ranges[np.isfinite(s.ranges)], initial=0) > 55 for s in scans), name


def test_messages_that_no_sensor_gives_are_left_out_counted_and_named(tmp_path: Path) -> None:
    lines = [
        "GEOMETRY,/scan,-1,0.01,0,0.1,30\n",
        "SCAN,1,/scan,laser,2,1.0,2.0\n",
        "ODOM,1,/odom,odom,base_link,nan,0,0\n",
        "ODOM,2,/odom,odom,base_link,1e300,0,0\n",
        "ODOM,inf,/odom,odom,base_link,0,0,0\n",
        "TF,1,/tf,base_link,laser,1,nan,0,0,0,0,0,1\n",
        "GEOMETRY,/scan,-1,nan,0,0.1,30\n",
        "SCAN,2,/scan,laser,2,1.0,2.0\n",
        "ODOM,3,/odom,odom,base_link,3,0,0\n",
    ]
    recording, messages = read(text(tmp_path / "a.csv", lines))
    assert [message.stamp for message in messages] == [1.0, 3.0]
    assert recording.notes.malformed == 6
    told = recording.notes.examples
    assert told[0] == "a.csv:3: ODOM: x = nan: must be within 1e7 m of the origin"
    assert [example.split(":")[1] for example in told] == ["3", "4", "5", "6", "7"]
