from __future__ import annotations

import math
import sqlite3
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made import Entry, Ros, bag1, bag2, drive_entries, read, refusal, texts
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from groma.errors import UserError
from groma.io.containers import Channel
from groma.io.recording import open_recording, write_recording
from groma.nouns.messages import BeamGeometry, JointState, LaserScan, Message, Odometry, Transform

Make = Callable[[Path, list[Entry]], Path]

CHATTER = {"/chatter [std_msgs/msg/String]": 1}


def one_file(folder: Path) -> Path:
    return next(p for p in folder.iterdir() if p.suffix in (".mcap", ".db3"))


MAKERS: dict[str, tuple[int, Make]] = {
    "bag": (1, lambda path, entries: bag1(path / "a.bag", entries)),
    "bag bz2": (1, lambda path, entries: bag1(path / "a.bag", entries, Writer1.CompressionFormat.BZ2)),
    "bag lz4": (1, lambda path, entries: bag1(path / "a.bag", entries, Writer1.CompressionFormat.LZ4)),
    "mcap folder": (2, lambda path, entries: bag2(path / "a", entries, StoragePlugin.MCAP)),
    "mcap": (2, lambda path, entries: one_file(bag2(path / "a", entries, StoragePlugin.MCAP))),
    "mcap zstd": (
        2,
        lambda path, entries: one_file(bag2(path / "a", entries, StoragePlugin.MCAP, CompressionMode.STORAGE)),
    ),
    "db3 folder": (2, lambda path, entries: bag2(path / "a", entries, StoragePlugin.SQLITE3)),
    "db3": (2, lambda path, entries: one_file(bag2(path / "a", entries, StoragePlugin.SQLITE3))),
    "db3 messages zstd": (
        2,
        lambda path, entries: bag2(path / "a", entries, StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
    ),
}


@pytest.mark.parametrize("name", MAKERS)
def test_a_drive_reads_the_same_from_every_container(tmp_path: Path, name: str) -> None:
    version, make = MAKERS[name]
    recording, messages = read(make(tmp_path, drive_entries(Ros(version), 3)))
    assert [type(m) for m in messages] == [Transform, *[*[Odometry] * 4, LaserScan] * 3, JointState]
    mount, odometry, *_, scan, joints = messages
    assert mount == Transform(
        100.0, "/tf_static", "base_link", "laser", (0.3, 0, 0), (0, 0, math.sin(0.05), math.cos(0.05)), static=True
    )
    assert isinstance(odometry, Odometry)
    assert (odometry.stamp, odometry.x, odometry.frame) == (100.0, 10.0, "odom")
    assert isinstance(scan, LaserScan)
    assert (scan.stamp, scan.stream, scan.frame) == (102.0, "/scan", "laser")
    np.testing.assert_allclose(scan.ranges, np.linspace(1, 9, 90), rtol=1e-6)
    assert isinstance(joints, JointState)
    assert joints.names == ("left", "right")
    np.testing.assert_array_equal(joints.positions, [1.0, 2.0])
    assert np.isnan(joints.velocities).all()
    assert recording.notes.skipped == CHATTER
    assert recording.notes.malformed == 0
    assert {s.name: s.count for s in recording.streams} == {
        "/tf_static": 1,
        "/odom": 12,
        "/scan": 3,
        "/joint_states": 1,
    }


def test_only_what_is_requested_is_decoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = open_recording(bag1(tmp_path / "a.bag", drive_entries(Ros(1), 3)))
    decoded = set()
    decoder = recording._decoder  # type: ignore[attr-defined]
    original = decoder.decode

    def spy(channel: Channel, recorded: int, data: bytes) -> Iterator[Message]:
        decoded.add(channel.topic)
        yield from original(channel, recorded, data)

    monkeypatch.setattr(decoder, "decode", spy)
    assert {m.stream for m in recording.messages({"/scan"})} == {"/scan"}
    assert decoded == {"/scan"}


def scan_of(tmp_path: Path, ranges: list[float], **changes: Any) -> tuple[list[str], LaserScan]:
    recording, messages = read(bag1(tmp_path / "a.bag", [("/scan", 5.0, Ros(1).scan(5.0, ranges, **changes))]))
    (scan,) = messages
    assert isinstance(scan, LaserScan)
    return texts(recording), scan


def test_ranges_follow_rep_117(tmp_path: Path) -> None:
    _, scan = scan_of(tmp_path, [1.0, math.inf, -math.inf, math.nan, 0.05, 0.0, -1.0, 30.0, 31.0])
    nan = math.nan
    np.testing.assert_array_equal(scan.ranges, [1.0, math.inf, nan, nan, nan, nan, nan, math.inf, math.inf])


@pytest.mark.parametrize(
    ("excess", "told"), [(1, "one beam too many"), (-1, "one beam too few"), (0, None), (0.3, None), (2, "2 beams")]
)
def test_the_fence_post(tmp_path: Path, excess: float, told: str | None) -> None:
    notes, scan = scan_of(tmp_path, [1.0] * 10, angle_max=-1.0 + 0.01 * (9 + excess))
    assert any("angle_max counts" in line for line in notes) == (told is not None)
    assert told is None or any(told in line for line in notes)
    assert scan.geometry.angle_min == -1.0


def test_a_step_of_zero_is_malformed_and_told(tmp_path: Path) -> None:
    recording, messages = read(
        bag1(tmp_path / "a.bag", [("/scan", 5.0, Ros(1).scan(5.0, [1.0, 2.0], angle_increment=0.0))])
    )
    assert messages == []
    assert "make no fan" in recording.notes.examples[0]


def test_a_scan_without_readings_is_malformed(tmp_path: Path) -> None:
    recording, messages = read(bag1(tmp_path / "a.bag", [("/scan", 5.0, Ros(1).scan(5.0, []))]))
    assert messages == []
    assert "without readings" in recording.notes.examples[0]


def test_a_range_max_of_zero_is_told(tmp_path: Path) -> None:
    notes, scan = scan_of(tmp_path, [1.0, 2.0], range_max=0.0)
    np.testing.assert_array_equal(scan.ranges, [1.0, 2.0])
    assert any("range_max 0 m makes no sense" in line for line in notes)


def test_a_missing_stamp_becomes_the_time_of_recording(tmp_path: Path) -> None:
    recording, (scan,) = read(bag1(tmp_path / "a.bag", [("/scan", 77.0, Ros(1).scan(0.0, [1.0]))]))
    assert scan.stamp == 77.0
    assert any("without a stamp" in line for line in texts(recording))


SCANS = 1000
CUTTABLE = ("bag", "bag bz2", "mcap", "mcap zstd", "db3")


@pytest.mark.parametrize("name", CUTTABLE)
@pytest.mark.parametrize("share", [0.3, 0.7, 0.97])
def test_a_cut_bag_gives_what_precedes_the_cut(tmp_path: Path, name: str, share: float) -> None:
    version, make = MAKERS[name]
    rng = np.random.default_rng(0)
    ros = Ros(version)
    entries = [("/scan", k + 1.0, ros.scan(k + 1.0, rng.uniform(1, 9, 1000).tolist())) for k in range(SCANS)]
    whole = make(tmp_path, entries)
    cut = tmp_path / f"cut{whole.suffix}"
    cut.write_bytes(whole.read_bytes()[: int(share * whole.stat().st_size)])
    recording, messages = read(cut)
    assert 0.5 * share * SCANS < len(messages) < SCANS
    assert [m.stamp for m in messages] == [k + 1.0 for k in range(len(messages))]
    assert "cut or damaged" in recording.notes.cut


@pytest.mark.parametrize("name", CUTTABLE)
def test_a_bag_cut_at_any_byte_is_read_or_refused_in_one_line(tmp_path: Path, name: str) -> None:
    version, make = MAKERS[name]
    whole = make(tmp_path, drive_entries(Ros(version), 2)).read_bytes()
    for size in sorted({1, 5, 9, 14, 40, *range(0, len(whole), max(1, len(whole) // 25))}):
        path = tmp_path / "cut"
        path.write_bytes(whole[:size])
        assert "\n" not in refusal(path)


@pytest.mark.parametrize("name", CUTTABLE)
def test_a_bag_with_flipped_bytes_never_breaks_the_reader(tmp_path: Path, name: str) -> None:
    version, make = MAKERS[name]
    whole = make(tmp_path, drive_entries(Ros(version), 2)).read_bytes()
    rng = np.random.default_rng(3)
    path = tmp_path / "flipped"
    for _ in range(25):
        data = bytearray(whole)
        for at in rng.integers(0, len(data), 5):
            data[at] = rng.integers(256)
        path.write_bytes(data)
        assert "\n" not in refusal(path)


def test_a_ros1_bag_without_index(tmp_path: Path) -> None:
    path = bag1(tmp_path / "a.bag", drive_entries(Ros(1), 3))
    data = bytearray(path.read_bytes())
    at = data.index(b"index_pos=") + len(b"index_pos=")
    data[at : at + 8] = bytes(8)
    path.write_bytes(data)
    recording, messages = read(path)
    assert len(messages) == 17
    assert any("the file was scanned" in line for line in texts(recording))
    assert {s.name: s.count for s in recording.streams}["/scan"] == 3


def test_a_database_that_is_no_bag(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE t (x)")
    database.close()
    with pytest.raises(UserError, match="no readable ROS 2 bag"):
        open_recording(path)


def test_a_folder_without_metadata(tmp_path: Path) -> None:
    folder = bag2(tmp_path / "a", drive_entries(Ros(2), 2), StoragePlugin.MCAP)
    (folder / "metadata.yaml").unlink()
    assert len(read(folder)[1]) == 12


def test_a_folder_whose_file_is_missing(tmp_path: Path) -> None:
    folder = bag2(tmp_path / "a", drive_entries(Ros(2), 2), StoragePlugin.MCAP)
    one_file(folder).unlink()
    with pytest.raises(UserError, match="missing"):
        open_recording(folder)


def test_a_folder_with_other_yaml(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("a: 1")
    with pytest.raises(UserError, match="no description"):
        open_recording(tmp_path)


def test_files_compressed_as_a_whole_are_refused(tmp_path: Path) -> None:
    folder = bag2(tmp_path / "a", drive_entries(Ros(2), 2), StoragePlugin.MCAP, CompressionMode.FILE)
    with pytest.raises(UserError, match="zstd -d"):
        open_recording(folder)


def alike(a: Message, b: Message) -> bool:
    def close(x: Any, y: Any) -> bool:
        if isinstance(x, BeamGeometry):
            return all(close(getattr(x, f.name), getattr(y, f.name)) for f in fields(x))
        if isinstance(x, str | bool) or (isinstance(x, tuple) and x and isinstance(x[0], str)):
            return bool(x == y)
        return bool(np.allclose(x, y, rtol=1e-6, atol=1e-7, equal_nan=True))

    return type(a) is type(b) and all(close(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))


def test_what_is_written_as_mcap_is_read_back(tmp_path: Path) -> None:
    geometry = BeamGeometry(-1.0, 0.01, 1e-4, 0.1, 30.0)
    ranges = np.array([1.0, np.inf, np.nan, 2.5])
    messages: list[Message] = [
        Transform(1.0, "/tf_static", "base_link", "laser", (0.1, 0.2, 0.3), (0, 0, 0, 1), static=True),
        Transform(1.25, "/tf", "odom", "base_link", (1.0, 2.0, 0.0), (0, 0, 0.6, 0.8)),
        Odometry(1.5, "/odom", 1.0, -2.0, 3.0),
        LaserScan(1_700_000_000.25, "/scan", "laser", geometry, ranges, np.arange(4.0)),
        JointState(2.0, "/joints", ("a", "b"), np.array([1.0, np.nan]), np.array([3.0, 4.0])),
    ]
    write_recording(tmp_path / "a.mcap", messages)
    recording, back = read(tmp_path / "a.mcap")
    assert len(back) == len(messages)
    assert all(alike(a, b) for a, b in zip(messages, back, strict=True))
    assert recording.format == "MCAP"
    assert texts(recording) == ["readings that are no range: 1 NaN"]
    assert list(tmp_path.iterdir()) == [tmp_path / "a.mcap"]


def test_two_kinds_under_one_name_become_two_topics(tmp_path: Path) -> None:
    geometry = BeamGeometry(-1.0, 0.01, 0.0, 0.1, 30.0)
    scan = LaserScan(1.0, "FLASER", "laser", geometry, np.ones(3))
    write_recording(tmp_path / "a.mcap", [Odometry(1.0, "FLASER", 0, 0, 0), scan])
    assert [m.stream for m in read(tmp_path / "a.mcap")[1]] == ["/FLASER", "/FLASER_laserscan"]


def test_the_library_reads_what_we_write(tmp_path: Path) -> None:
    from rosbags.highlevel import AnyReader

    write_recording(tmp_path / "a.mcap", [Odometry(1.5, "/odom", 1.0, -2.0, 3.0)])
    with AnyReader([tmp_path / "a.mcap"]) as reader:
        ((connection, time, data),) = list(reader.messages())
        message: Any = reader.deserialize(data, connection.msgtype)
    assert (time, message.pose.pose.position.y) == (1_500_000_000, -2.0)


def test_a_stamp_that_ros_cannot_hold(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="ROS times"):
        write_recording(tmp_path / "a.mcap", [Odometry(-1.0, "/odom", 0, 0, 0)])
