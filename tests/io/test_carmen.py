from __future__ import annotations

import gzip
import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made import RANGES, drive_lines, flaser, read, text, texts

from groma.io.carmen_lines import LineError, parse_flaser, parse_odom, parse_rawlaser, parse_robotlaser
from groma.io.streams import Kind
from groma.nouns.bounds import OutOfRangeError
from groma.nouns.messages import LaserScan, Odometry, Transform

SENSOR = "0 -1.570796 3.141593 0.017453 30.0 0.01 1 4 1.0 2.0 30.0 31.0"


def of_type(messages: Sequence[object], kind: type) -> list[object]:
    return [message for message in messages if isinstance(message, kind)]


def test_flaser_gives_mounting_odometry_and_scan(tmp_path: Path) -> None:
    recording, (mount, odometry, scan, *_) = read(text(tmp_path / "a.log", ["# remark\n", *drive_lines(3)]))
    assert isinstance(mount, Transform)
    assert mount.static
    assert (mount.parent, mount.child) == ("base_link", "laser")
    assert mount.translation == pytest.approx((0.2, 0.0, 0.0))
    assert odometry == Odometry(100.0, "FLASER", 0.0, 0.0, 0.0)
    assert isinstance(scan, LaserScan)
    assert (scan.stamp, scan.stream, scan.frame) == (100.0, "FLASER", "laser")
    np.testing.assert_array_equal(scan.ranges, RANGES)
    assert {(s.kind, s.count) for s in recording.streams} == {(Kind.SCAN, 3), (Kind.ODOMETRY, 3)}


def test_mounting_is_given_once_and_again_when_it_changes(tmp_path: Path) -> None:
    far = [flaser(laser=(0.9, 0, 0), robot=(0, 0, 0), times=f"{200 + k} h 0") for k in range(1)]
    _, messages = read(text(tmp_path / "a.log", [*drive_lines(30), *far]))
    assert [m.translation[0] for m in messages if isinstance(m, Transform)] == pytest.approx([0.2, 0.9])


def test_mounting_turned_with_the_robot(tmp_path: Path) -> None:
    line = flaser(laser=(1.0, 2.3, math.pi), robot=(1.0, 2.0, math.pi / 2))
    _, (mount, *_) = read(text(tmp_path / "a.log", line))
    assert isinstance(mount, Transform)
    assert mount.translation == pytest.approx((0.3, 0.0, 0.0))
    assert 2 * math.atan2(mount.quaternion[2], mount.quaternion[3]) == pytest.approx(math.pi / 2)


def test_a_laser_pose_that_was_corrected_is_no_mounting(tmp_path: Path) -> None:
    lines = [flaser(laser=(0.3 * k, 0.1 * k, 0), robot=(0.1 * k, 0, 0), times=f"{k + 1} h {k}") for k in range(20)]
    recording, messages = read(text(tmp_path / "a.log", lines))
    assert not of_type(messages, Transform)
    assert any("corrected by another program" in line for line in texts(recording))


@pytest.mark.parametrize(
    ("count", "first", "step"),
    [
        (180, -90, 1),
        (181, -90, 1),
        (360, -90, 0.5),
        (361, -90, 0.5),
        (401, -50, 0.25),
        (541, -135, 0.5),
        (1081, -135, 0.25),
        (769, -135, 360 / 1024),
        (91, -90, 2),
    ],
)
def test_beams_by_their_number(tmp_path: Path, count: int, first: float, step: float) -> None:
    recording, messages = read(text(tmp_path / "a.log", flaser([1.0] * count)))
    geometry = messages[-1].geometry  # type: ignore[union-attr]
    assert math.degrees(geometry.angle_min) == pytest.approx(first)
    assert math.degrees(geometry.angle_increment) == pytest.approx(step)
    assert any(f"{count} beams" in line for line in texts(recording))


def test_the_resolution_in_a_param_line_wins(tmp_path: Path) -> None:
    lines = ["PARAM laser_front_laser_resolution 0.5 nohost 0\n", *drive_lines(2)]
    _, messages = read(text(tmp_path / "a.log", lines))
    assert math.degrees(messages[-1].geometry.angle_increment) == pytest.approx(0.5)  # type: ignore[union-attr]


def test_a_resolution_that_does_not_fit_is_told_and_not_used(tmp_path: Path) -> None:
    lines = ["PARAM laser_front_laser_resolution 5 nohost 0\n", *drive_lines(2)]
    recording, messages = read(text(tmp_path / "a.log", lines))
    assert math.degrees(messages[-1].geometry.angle_increment) == pytest.approx(1)  # type: ignore[union-attr]
    assert any("does not fit" in line for line in texts(recording))


def test_robotlaser_has_its_own_geometry_and_remissions(tmp_path: Path) -> None:
    line = f"ROBOTLASER1 {SENSOR} 4 7 8 9 10 0.5 0 0 0.4 0 0 0 0 0 0 0 12.5 host 3\n"
    _, (mount, odometry, scan) = read(text(tmp_path / "a.clf", line))
    assert isinstance(mount, Transform)
    assert mount.translation == pytest.approx((0.1, 0.0, 0.0))
    assert odometry == Odometry(12.5, "ROBOTLASER1", 0.4, 0.0, 0.0)
    assert isinstance(scan, LaserScan)
    assert scan.geometry.angle_increment == math.radians(1)
    assert scan.geometry.angle_min == -math.pi / 2
    np.testing.assert_array_equal(scan.ranges, [1.0, 2.0, np.inf, np.inf])
    np.testing.assert_array_equal(scan.intensities, [7, 8, 9, 10])


def test_rawlaser_has_no_poses(tmp_path: Path) -> None:
    _, messages = read(text(tmp_path / "a.clf", f"RAWLASER1 {SENSOR} 0 12.5 host 3\n"))
    assert [type(m) for m in messages] == [LaserScan]


def test_lines_of_other_tools_are_counted(tmp_path: Path) -> None:
    lines = [" " + drive_lines(1)[0], "VERTEX2 0 1 2 3\n", "NEFF 60\n", "NEFF 61\n", "\n"]
    recording, messages = read(text(tmp_path / "a.log", lines))
    assert len(of_type(messages, LaserScan)) == 1
    assert recording.notes.skipped == {"VERTEX2": 1, "NEFF": 2}


def test_odom_lines_are_a_stream_of_their_own(tmp_path: Path) -> None:
    lines = [*drive_lines(2), "ODOM 1 2 3 0.1 0.2 0.3 100.5 host 0.5\n"]
    recording, messages = read(text(tmp_path / "a.log", lines))
    assert messages[-1] == Odometry(100.5, "ODOM", 1, 2, 3)
    assert [m.stream for m in recording.messages(["ODOM"])] == ["ODOM"]


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        (["10 h 1", "11 h 2", "12 h 3"], [10, 11, 12]),
        (["1000000000 h 250000", "1000000000 h 750000", "1000000001 h 0"], [1e9 + 0.25, 1e9 + 0.75, 1e9 + 1]),
        (["0 h 0", "0 h 0", "0 h 0"], [0, 1, 2]),
        (["1.1009e+09 h 5", "1.1009e+09 h 6", "1.1009e+09 h 8"], [5, 6, 8]),
        (["", "", ""], [0, 1, 2]),
        (["3 h", "4 h", "5 h"], [3, 4, 5]),
    ],
    ids=["ipc", "seconds and microseconds", "zeros", "six digits", "none", "old"],
)
def test_clocks(tmp_path: Path, times: list[str], expected: list[float]) -> None:
    recording, _ = read(text(tmp_path / "a.log", [flaser(times=t) for t in times]))
    assert [m.stamp for m in recording.messages() if isinstance(m, LaserScan)] == expected
    assumed = [line for line in texts(recording) if "times" in line]
    assert bool(assumed) == (expected[0] in (0, 5))


def test_too_close_flags_behind_the_ranges(tmp_path: Path) -> None:
    line = flaser([*RANGES, *[0] * 180], count=180)
    recording, messages = read(text(tmp_path / "a.log", line))
    assert recording.notes.malformed == 0
    np.testing.assert_array_equal(messages[-1].ranges, RANGES)  # type: ignore[union-attr]


def test_bad_beams_cost_a_beam_and_not_the_scan(tmp_path: Path) -> None:
    ranges = [1.0, "nan", "inf", "-inf", -2.0, 0.0, "x", 3.0]
    recording, messages = read(text(tmp_path / "a.log", flaser(ranges)))
    expected = [1.0, np.nan, np.inf, np.nan, np.nan, np.nan, np.nan, 3.0]
    np.testing.assert_array_equal(messages[-1].ranges, expected)  # type: ignore[union-attr]
    assert recording.notes.beams == {"NaN": 2, "negative": 2, "zero": 1, "unreadable": 1}


def test_a_wrong_count_is_told_with_its_line(tmp_path: Path) -> None:
    lines = [drive_lines(1)[0], flaser(count=181, times="101 h 1"), flaser(count=20, times="102 h 2"), "FLASER x 1\n"]
    recording, messages = read(text(tmp_path / "a.log", lines))
    assert len(of_type(messages, LaserScan)) == 1
    assert recording.notes.malformed == 3
    assert [example.split(": ")[0] for example in recording.notes.examples] == ["a.log:2", "a.log:3", "a.log:4"]


def test_a_second_pass_counts_anew(tmp_path: Path) -> None:
    recording, _ = read(text(tmp_path / "a.log", [*drive_lines(1), "FLASER x\n", "NEFF 1\n"]))
    list(recording.messages())
    assert recording.notes.malformed == 1
    assert recording.notes.skipped == {"NEFF": 1}


def test_a_cut_gz_gives_what_precedes_the_cut(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    lines = [line for k in range(50) for line in drive_lines(1, rng.uniform(1, 9, 180).round(3).tolist(), 100.0 + k)]
    whole = gzip.compress("".join(lines).encode())
    path = tmp_path / "a.log.gz"
    path.write_bytes(whole[: len(whole) // 2])
    recording, messages = read(path)
    assert 10 < len(of_type(messages, LaserScan)) < 40
    assert "cut" in recording.notes.cut


def test_binary_rubbish_in_the_middle(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    data = [line.encode() for line in drive_lines(2)]
    path.write_bytes(data[0] + bytes(range(256)) * 10_000 + b"\n" + data[1])
    recording, messages = read(path)
    assert len(of_type(messages, LaserScan)) == 2
    assert recording.notes.skipped or recording.notes.malformed


@pytest.mark.parametrize("code", [50.0, 81.83, 8.183, 32.767, 29.9])
def test_the_no_return_value_is_found_in_the_data(tmp_path: Path, code: float) -> None:
    rng = np.random.default_rng(2)
    lines = []
    for k in range(60):
        ranges = rng.uniform(1, 0.8 * code, 180)
        ranges[rng.random(180) < 0.05] = code
        pose = (0.3 * k, 0.0, 0.0)
        lines.append(flaser(ranges.round(2 if code > 9 else 3).tolist(), pose, pose, f"{k + 1} h {k}"))
    _, messages = read(text(tmp_path / "a.log", lines))
    scans = [m for m in messages if isinstance(m, LaserScan)]
    assert sum(int(np.isinf(s.ranges).sum()) for s in scans) == pytest.approx(540, abs=100)
    assert max(s.ranges[np.isfinite(s.ranges)].max() for s in scans) < 0.81 * code


def test_the_far_wall_of_a_robot_that_stands_is_a_wall(tmp_path: Path) -> None:
    ranges = [2.0] * 170 + [20.0] * 10
    recording, messages = read(text(tmp_path / "a.log", [flaser(ranges, times=f"{k + 1} h 0") for k in range(50)]))
    assert all(np.isfinite(m.ranges).all() for m in messages if isinstance(m, LaserScan))
    assert any("no return is unknown" in line for line in texts(recording))


def test_a_narrow_place_is_no_scanner_limit(tmp_path: Path) -> None:
    _, messages = read(text(tmp_path / "a.log", drive_lines(60, [1.0] * 180)))
    assert np.isfinite(messages[-1].ranges).all()  # type: ignore[union-attr]


def test_a_planner_setting_is_no_scanner_limit(tmp_path: Path) -> None:
    lines = ["PARAM robot_front_laser_max 1.5 nohost 0\n", *drive_lines(2)]
    _, messages = read(text(tmp_path / "a.log", lines))
    assert np.isfinite(messages[-1].ranges).all()  # type: ignore[union-attr]


TOKENS = st.lists(
    st.one_of(
        st.sampled_from(
            [b"FLASER", b"3", b"1.0", b"nan", b"-1", b"1e400", b"0", b"h", b"\xff", b"1_0", b"99999999999"]
        ),
        st.binary(min_size=1, max_size=4).filter(lambda token: token.split() != []),
    ),
    max_size=40,
)


@settings(deadline=None)
@given(TOKENS)
def test_no_line_does_more_than_raise_its_own_error(tokens: list[bytes]) -> None:
    for parse in (parse_flaser, parse_rawlaser, parse_robotlaser, parse_odom):
        with suppress(LineError, OutOfRangeError):
            parse([b"TAG", *tokens])


@settings(deadline=None)
@given(st.lists(st.tuples(st.sampled_from([b"FLASER", b"ODOM", b"RAWLASER1", b"ROBOTLASER1"]), TOKENS), max_size=5))
def test_no_file_raises(tmp_path_factory: pytest.TempPathFactory, lines: list[tuple[bytes, list[bytes]]]) -> None:
    path = tmp_path_factory.mktemp("fuzz") / "a.log"
    path.write_bytes(b"PARAM a b\n" + b"".join(b" ".join([tag, *rest]) + b"\n" for tag, rest in lines))
    recording, _ = read(path)
    assert texts(recording) is not None
