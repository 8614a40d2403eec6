from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from made import Ros, bag1, drive_entries, drive_lines, flaser, text

from groma.errors import UserError
from groma.io.drive import Drive, open_drive
from groma.io.recording import open_recording, write_recording
from groma.models import BeamGeometry, LaserScan, Message, Odometry, Transform

FAN = BeamGeometry(-1.0, 0.5, 0.0, 0.1, 30.0)
RANGES = np.array([1.0, 2.0, 3.0, 4.0])


def scan(stamp: float, stream: str = "/scan", geometry: BeamGeometry = FAN) -> LaserScan:
    return LaserScan(stamp, stream, "laser", geometry, RANGES.copy(), 10 * RANGES)


def pose(stamp: float, x: float = 0.0, stream: str = "/odom", theta: float = 0.0) -> Odometry:
    return Odometry(stamp, stream, x, 0.0, theta)


def made(tmp_path: Path, messages: Sequence[Message], **choice: str) -> Drive:
    write_recording(tmp_path / "a.csv", messages)
    return open_drive(open_recording(tmp_path / "a.csv"), **choice)


def test_a_carmen_drive(tmp_path: Path) -> None:
    drive = open_drive(open_recording(text(tmp_path / "a.log", drive_lines(5))))
    events = list(drive.events())
    assert [type(e) for e in events] == [Odometry, LaserScan] * 5
    assert (drive.scans, drive.odometry, drive.mount_known) == ("FLASER", "FLASER", True)
    assert (drive.mount.x, drive.mount.y, drive.mount.yaw) == pytest.approx((0.2, 0, 0))
    assert not drive.skipped
    assert len(list(drive.events())) == 10


def test_carmen_takes_the_pose_on_the_scan_line_and_odom_on_demand(tmp_path: Path) -> None:
    odom = [f"ODOM {k} 0 0 0 0 0 {100 + k / 10} host 0\n" for k in range(50)]
    path = text(tmp_path / "a.log", [*odom[:25], *drive_lines(5), *odom[25:]])
    drive = open_drive(open_recording(path))
    assert drive.odometry == "FLASER"
    assert any("others by --odometry: ODOM" in note.text for note in drive.notes)
    drive = open_drive(open_recording(path), odometry="ODOM")
    poses = [e for e in drive.events() if isinstance(e, Odometry)]
    assert {p.stream for p in poses} == {"ODOM"}
    assert len(poses) == 50


def test_a_bag_drive(tmp_path: Path) -> None:
    drive = open_drive(open_recording(bag1(tmp_path / "a.bag", drive_entries(Ros(1), 10))))
    assert (drive.scans, drive.odometry) == ("/scan", "/odom")
    assert (drive.mount.x, drive.mount.yaw) == pytest.approx((0.3, 0.1))
    events = list(drive.events())
    assert [e.stamp for e in events] == sorted(e.stamp for e in events)
    assert sum(isinstance(e, Odometry) for e in events) == 40


def test_odometry_up_to_the_last_beam_precedes_the_scan(tmp_path: Path) -> None:
    sweep = BeamGeometry(-1.0, 0.5, 0.1, 0.1, 30.0)
    messages: list[Message] = [scan(1.0, geometry=sweep), *[pose(1 + 0.05 * k) for k in range(12)]]
    events = list(made(tmp_path, messages).events())
    at = next(i for i, e in enumerate(events) if isinstance(e, LaserScan))
    assert [e.stamp for e in events[:at]] == pytest.approx([1 + 0.05 * k for k in range(7)])


def test_repeats_are_dropped_and_counted(tmp_path: Path) -> None:
    messages: list[Message] = [
        scan(1.0),
        scan(1.0),
        scan(2.0),
        pose(1.0),
        pose(1.0, 5.0),
    ]
    drive = made(tmp_path, messages)
    assert len(list(drive.events())) == 3
    assert drive.skipped == {
        "scans with the stamp of the one before": 1,
        "odometry with the stamp of the one before": 1,
    }


def test_jumps_are_counted_and_passed_on(tmp_path: Path) -> None:
    poses = [pose(k, x) for k, x in enumerate([0.0, 1.0, 2.0, 12.0, 13.0])]
    drive = made(tmp_path, [*poses, scan(4.0)])
    assert len(list(drive.events())) == 6
    assert drive.jumps == 1


def test_of_two_scanners_the_one_with_more_scans_is_taken_and_told(tmp_path: Path) -> None:
    messages: list[Message] = [scan(1.0, "/rear"), scan(1.0, "/front"), scan(2.0, "/front")]
    drive = made(tmp_path, messages)
    assert drive.scans == "/front"
    assert any("--scans" in note.text and "/rear" in note.text for note in drive.notes)
    assert made(tmp_path, messages, scans="/rear").scans == "/rear"


@pytest.mark.parametrize("choice", [{"scans": "/other"}, {"odometry": "/other"}])
def test_an_unknown_stream_lists_those_there_are(tmp_path: Path, choice: dict[str, str]) -> None:
    with pytest.raises(UserError, match=r"'/other'; there is: /(scan|odom)"):
        made(tmp_path, [scan(1.0), pose(1.0)], **choice)


def test_no_scans_is_the_users_mistake(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no laser scans"):
        made(tmp_path, [pose(1.0)])


def test_odometry_none(tmp_path: Path) -> None:
    drive = made(tmp_path, [scan(1.0), pose(1.0)], odometry="none")
    assert drive.odometry is None
    assert [type(e) for e in drive.events()] == [LaserScan]


def edge(stamp: float, parent: str, child: str, x: float, *, static: bool = False) -> Transform:
    return Transform(stamp, "/tf", parent, child, (x, 0.0, 0.0), (0.0, 0.0, 0.6, 0.8), static=static)


def test_odometry_from_tf_when_there_is_no_other(tmp_path: Path) -> None:
    moving = [edge(k, "odom", "base_footprint", 0.1 * k) for k in range(5)]
    others = [edge(k, "map", "odom", 0.2 * k) for k in range(5)]
    static = [
        edge(0.0, "base_footprint", "base_link", 0.5, static=True),
        edge(0.0, "base_link", "laser", 1, static=True),
    ]
    drive = made(tmp_path, [*static, *moving, *others, scan(1.5), scan(2.5)])
    assert drive.odometry == "tf:odom->base_footprint"
    poses = [e for e in drive.events() if isinstance(e, Odometry)]
    assert [p.x for p in poses] == pytest.approx([0.1 * k for k in range(5)])
    assert poses[0].theta == pytest.approx(2 * math.atan2(0.6, 0.8))
    assert drive.mount_known
    assert drive.mount.yaw == pytest.approx(4 * math.atan2(0.6, 0.8))


def test_a_mounting_published_as_moving_is_told(tmp_path: Path) -> None:
    messages: list[Message] = [edge(1.0, "base_link", "laser", 0.4), pose(1.0), scan(1.0), scan(2.0), pose(2.0)]
    drive = made(tmp_path, messages)
    assert drive.mount.x == pytest.approx(0.4)
    assert any("published as moving" in note.text for note in drive.notes)


def test_an_unknown_mounting_is_zero_and_told(tmp_path: Path) -> None:
    drive = made(tmp_path, [scan(1.0), pose(1.0)])
    assert not drive.mount_known
    assert (drive.mount.x, drive.mount.y, drive.mount.yaw) == (0, 0, 0)
    assert any("mounting of the laser unknown" in note.text for note in drive.notes)


def points(s: LaserScan) -> np.ndarray:
    bearings = s.geometry.angle_min + s.geometry.angle_increment * np.arange(len(s.ranges))
    times = s.stamp + s.geometry.time_increment * np.arange(len(s.ranges))
    stacked = np.column_stack([s.ranges * np.cos(bearings), s.ranges * np.sin(bearings), times, s.intensities])
    return np.asarray(stacked[np.argsort(times)])


@pytest.mark.parametrize("step", [0.5, -0.5])
def test_a_scanner_upside_down_sees_the_same_points_mirrored(tmp_path: Path, step: float) -> None:
    sweep = BeamGeometry(-1.0, step, 0.01, 0.1, 30.0)
    down = Transform(0.0, "/tf_static", "base_link", "laser", (0, 0, 0), (1, 0, 0, 0), static=True)
    original = scan(1.0, geometry=sweep)
    drive = made(tmp_path, [down, original, pose(1.0)])
    (seen,) = (e for e in drive.events() if isinstance(e, LaserScan))
    assert seen.geometry.angle_increment > 0
    np.testing.assert_allclose(points(seen), points(original) * [1, -1, 1, 1], atol=1e-12)
    assert any("upside down" in note.text for note in drive.notes)


def test_a_scanner_that_turns_clockwise_is_reversed(tmp_path: Path) -> None:
    original = scan(1.0, geometry=BeamGeometry(1.0, -0.5, 0.01, 0.1, 30.0))
    (seen,) = (e for e in made(tmp_path, [original]).events() if isinstance(e, LaserScan))
    assert seen.geometry.angle_increment == 0.5
    np.testing.assert_allclose(points(seen), points(original), atol=1e-12)


def test_a_log_that_goes_back(tmp_path: Path) -> None:
    stamps = [*range(1, 11), 9.5, *range(11, 21), *range(5, 26)]
    lines = [flaser(times=f"{s} h 0") for s in stamps]
    drive = open_drive(open_recording(text(tmp_path / "a.log", lines)))
    seen = [e.stamp for e in drive.events() if isinstance(e, LaserScan)]
    assert seen == sorted([*range(1, 26), 9.5])
    assert len(seen) + sum(n for why, n in drive.skipped.items() if why.startswith("scans")) == len(stamps)


@pytest.mark.shared
def test_shared_drives(shared: Path) -> None:
    intel = open_drive(open_recording(shared / "data/intel/derived/intel_raw3361.clf.gz"))
    assert sum(isinstance(e, LaserScan) for e in intel.events()) == 3361
    assert not intel.skipped
    flirt = open_drive(open_recording(shared / "data/intel/intel-lab.flirt.log.gz"))
    stamps = [e.stamp for e in flirt.events() if isinstance(e, LaserScan)]
    assert len(stamps) == 2672
    assert stamps == sorted(stamps)
    orebro = open_drive(open_recording(shared / "data/radish-corrected/orebro-corrected.log.gz"))
    assert sum(isinstance(e, LaserScan) for e in orebro.events()) == 237
