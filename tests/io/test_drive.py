from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from made import Ros, bag1, drive_entries, drive_lines, text

from groma.errors import UserError
from groma.io.recording import open_recording, write_recording
from groma.nouns.messages import BeamGeometry, LaserScan, Message, Odometry, Transform
from groma.recordings.drive import Drive, open_drive
from groma.simulation.scenes import scenario, simulate

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
    assert sum(isinstance(e, Odometry) for e in events) == 40


def test_a_simulated_scan_is_written_after_its_last_beam() -> None:
    """As a recorder does: the odometry until then comes before it."""
    made_up = simulate(scenario("warehouse", 3))
    newest = -math.inf
    scans_seen = 0
    for message in islice(iter(made_up), 3000):
        if isinstance(message, LaserScan):
            assert message.geometry.time_increment > 0
            assert message.stamp < newest <= message.end < newest + 0.1
            scans_seen += 1
        elif isinstance(message, Odometry):
            newest = message.stamp
    assert scans_seen > 50


def test_events_come_as_the_recording_has_them(tmp_path: Path) -> None:
    """What is late, repeated or no number is the core's to judge, and to tell."""
    messages: list[Message] = [scan(1.0), scan(1.0), scan(2.0), pose(1.0), pose(1.0, 5.0)]
    drive = made(tmp_path, messages)
    assert [(type(e), e.stamp) for e in drive.events()] == [(type(m), m.stamp) for m in messages]


def test_a_recording_in_order_asks_for_no_wait(tmp_path: Path) -> None:
    sweep = BeamGeometry(-1.0, 0.5, 0.02, 0.1, 30.0)
    messages = [m for k in range(50) for m in (pose(0.1 * k), scan(0.1 * k, geometry=sweep))]
    drive = made(tmp_path, messages)
    assert drive.lateness == 0.0
    assert not any("disordered" in str(note) for note in drive.notes)


@pytest.mark.parametrize(
    ("stamps", "lateness"),
    [
        ([0.0, 0.1, 0.3, 0.2, 0.4], 0.1),  # two that change places
        ([0.0, 0.1, 5e5, 0.2, 0.15, 0.3], 0.05),  # a stamp far ahead is no measure
        ([0.0, 3.0, 3.1, 1.0, 3.2], 2.0),  # no recording asks for more
    ],
)
def test_a_disordered_recording_asks_for_the_wait_it_needs_and_says_so(
    tmp_path: Path, stamps: list[float], lateness: float
) -> None:
    drive = made(tmp_path, [scan(0.0), *map(pose, stamps)])
    assert drive.lateness == pytest.approx(lateness, abs=0.002)
    assert drive.lateness >= lateness
    assert any("disordered" in str(note) for note in drive.notes) == (lateness > 0)


def test_odometry_far_behind_the_scans_is_waited_for(tmp_path: Path) -> None:
    def lagging(lag: float) -> list[Message]:
        arrivals = [(0.1 * k, scan(0.1 * k)) for k in range(30)] + [(0.1 * k + lag, pose(0.1 * k)) for k in range(30)]
        return [message for _, message in sorted(arrivals, key=lambda arrival: arrival[0])]

    assert made(tmp_path, lagging(0.05)).lateness == 0.0
    assert made(tmp_path, lagging(0.35)).lateness >= 0.3


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


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("first", [-100.0, 0.0, 100.0])
@pytest.mark.parametrize("step", [-6.0, -1.0, -0.01, 0.01, 1.0])
@pytest.mark.parametrize(("stamp", "between"), [(1.0, 0.0), (1e11, 0.01), (1e11, -0.01), (-1e11, -10.0)])
def test_a_scan_that_can_be_read_can_be_turned_upright(
    tmp_path: Path, flipped: bool, first: float, step: float, stamp: float, between: float
) -> None:
    quaternion = "1,0,0,0" if flipped else "0,0,0,1"
    readings = ",".join(["2.0"] * 181)
    (tmp_path / "log.csv").write_text(
        f"TF,0,/tf_static,base_link,laser,1,0,0,0,{quaternion}\n"
        f"GEOMETRY,/scan,{first},{step},{between},0.1,30\n"
        f"SCAN,{stamp},/scan,laser,181,{readings}\nODOM,0,/odom,odom,base_link,0,0,0\n"
    )
    recording = open_recording(tmp_path / "log.csv")
    seen = [event for event in open_drive(recording).events() if isinstance(event, LaserScan)]
    good = abs(first + 180 * step) <= 100 and abs(stamp + 180 * between) <= 1e11
    assert len(seen) == good
    assert good or any("log.csv:3" in note.text for note in recording.notes.findings())


@pytest.mark.shared
def test_shared_drives(shared: Path) -> None:
    intel = open_drive(open_recording(shared / "data/intel/derived/intel_raw3361.clf.gz"))
    assert sum(isinstance(e, LaserScan) for e in intel.events()) == 3361
    assert intel.lateness == 0
    flirt = open_drive(open_recording(shared / "data/intel/intel-lab.flirt.log.gz"))
    stamps = [e.stamp for e in flirt.events() if isinstance(e, LaserScan)]
    assert len(stamps) == 2672
    orebro = open_drive(open_recording(shared / "data/radish-corrected/orebro-corrected.log.gz"))
    assert sum(isinstance(e, LaserScan) for e in orebro.events()) == 237
