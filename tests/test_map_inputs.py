"""`groma map` on recordings as they should not be, and on scanners unlike the usual ones: always a map, or one line."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import groma.cli
from drives import Array, Driven, drive, mapped, scans, scene
from groma.io.recording import open_recording, write_recording
from groma.mapping.result import MapResult
from groma.nouns.messages import LaserScan, Message, Odometry, Transform

BEAMS: dict[str, Any] = {"beams": 181, "angle_increment": math.radians(1.5), "period": 0.4}


@pytest.fixture(scope="module")
def rooms() -> Driven:
    """50 m."""
    return drive(scene("rooms", **BEAMS), 80.0)


def each_scan(change: Callable[[int, LaserScan], LaserScan | None]) -> Callable[[list[Message]], Iterable[Message]]:
    """Change every scan, told its number; None drops it."""

    def changed(messages: list[Message]) -> Iterable[Message]:
        number = {id(scan): k for k, scan in enumerate(scans(messages))}
        new = (change(number[id(m)], m) if isinstance(m, LaserScan) else m for m in messages)
        return [message for message in new if message is not None]

    return changed


def each_odometry(change: Callable[[Odometry], Odometry | None]) -> Callable[[list[Message]], Iterable[Message]]:
    def changed(messages: list[Message]) -> Iterable[Message]:
        new = (change(m) if isinstance(m, Odometry) else m for m in messages)
        return [message for message in new if message is not None]

    return changed


def with_ranges(scan: LaserScan, ranges: Array) -> LaserScan:
    return replace(scan, ranges=ranges, intensities=np.empty(0))


def with_bad_readings(k: int, scan: LaserScan) -> LaserScan:
    """A tenth of the readings, in turn, is no range."""
    ranges = scan.ranges.copy()
    for start, value in enumerate((math.nan, math.inf, -math.inf, -1.0, 0.0, 1e9)):
        ranges[(k + 10 * start) % 60 :: 60] = value
    return with_ranges(scan, ranges)


def with_half_the_beams(k: int, scan: LaserScan) -> LaserScan:
    if k % 200 < 100:
        return scan
    g = scan.geometry
    return replace(with_ranges(scan, scan.ranges[::2]), geometry=replace(g, angle_increment=2 * g.angle_increment))


def from_the_left(_: int, scan: LaserScan) -> LaserScan:
    g, last = scan.geometry, len(scan.ranges) - 1
    turned = replace(g, angle_min=g.angle_min + last * g.angle_increment, angle_increment=-g.angle_increment)
    return replace(with_ranges(scan, scan.ranges[::-1]), geometry=turned)


def jumping(reading: Odometry) -> Odometry:
    """At 140 s it is suddenly 2 m and 90 degrees elsewhere."""
    if reading.stamp < 140:
        return reading
    return replace(reading, x=-reading.y + 2.0, y=reading.x, theta=reading.theta + math.pi / 2)


def sometimes_no_number(reading: Odometry) -> Odometry:
    if round(reading.stamp * 10) % 7:
        return reading
    spoiled = replace(reading)
    object.__setattr__(spoiled, "x", math.nan)  # what no constructor makes, a file may hold
    return spoiled


def in_wrong_order(messages: list[Message]) -> list[Message]:
    """Neighbours change places, ten at a time."""
    return [m for k in range(0, len(messages), 10) for m in reversed(messages[k : k + 10])]


def twice(messages: list[Message]) -> list[Message]:
    return [m for message in messages for m in (message, message)]


def upside_down(messages: list[Message]) -> Iterable[Message]:
    """The scanner is turned about its forward axis: what it takes for left is right."""
    for message in messages:
        if isinstance(message, Transform):
            yield replace(message, quaternion=(1.0, 0.0, 0.0, 0.0))
        elif isinstance(message, LaserScan):
            yield with_ranges(message, message.ranges[::-1])
        else:
            yield message


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(each_scan(with_bad_readings), id="readings that are no range"),
        pytest.param(each_scan(with_half_the_beams), id="the number of beams changes"),
        pytest.param(each_scan(from_the_left), id="negative angle_increment"),
        pytest.param(each_scan(lambda k, scan: None if 90 < k < 100 else scan), id="scans are missing"),
        pytest.param(each_odometry(lambda r: r if r.stamp < 140 else None), id="odometry stops halfway"),
        pytest.param(each_odometry(lambda r: r if r.stamp > 140 else None), id="odometry starts late"),
        pytest.param(each_odometry(jumping), id="odometry jumps"),
        pytest.param(
            each_odometry(lambda r: replace(r, x=0.0, y=0.0, theta=0.0) if r.stamp > 120 else r), id="odometry dies"
        ),
        pytest.param(each_odometry(sometimes_no_number), id="odometry is NaN"),
        pytest.param(in_wrong_order, id="wrong order of time"),
        pytest.param(twice, id="everything twice"),
        pytest.param(upside_down, id="upside down"),
    ],
)
def test_still_a_map_as_good_as_ever(
    rooms: Driven, tmp_path: Path, change: Callable[[list[Message]], Iterable[Message]]
) -> None:
    path = rooms.write(tmp_path / "drive.mcap", change)
    result = mapped(path)
    errors = rooms.errors(result)
    assert len(errors.translation) == errors.total > 10
    assert errors.translation.max() < 0.05
    assert errors.rotation.max() < 0.5


def left_out(result: MapResult) -> set[tuple[str, int]]:
    """Codes of findings, each with the first of its numbers."""
    return {(f.code, round(next(iter(f.values.values()))[0])) for f in result.findings}


def test_what_was_left_out_is_counted(rooms: Driven, tmp_path: Path) -> None:
    count = len(rooms.truth.stamps)
    path = rooms.write(tmp_path / "a.mcap", each_odometry(sometimes_no_number))
    recording = open_recording(path)
    assert sum(1 for _ in recording.messages()) > 1000
    assert recording.notes.malformed > 100
    repeated = left_out(mapped(rooms.write(tmp_path / "b.mcap", twice)))
    assert ("stamps-invalid", count) in repeated
    empty = each_scan(lambda k, scan: with_ranges(scan, np.full(181, math.inf)) if k < 7 else scan)
    result = mapped(rooms.write(tmp_path / "c.mcap", empty))
    assert ("scans-unusable", 7) in left_out(result)
    assert result.counts["scans_used"] == count - 7


@pytest.mark.parametrize(
    ("scanner", "bound"),
    [
        pytest.param({"beams": 360, "angle_min": -math.pi, "angle_increment": math.tau / 360}, 0.05, id="all round"),
        pytest.param({"beams": 720, "range_max": 4.0}, 0.1, id="short-sighted"),
        pytest.param({"beams": 61, "angle_min": -math.pi / 6, "angle_increment": math.pi / 180}, 0.15, id="narrow"),
        pytest.param({"beams": 20, "angle_increment": 1.5 * math.pi / 19}, 0.15, id="20 beams"),
        pytest.param({"mount": (-0.2, 0.1, 3.0)}, 0.05, id="looks back"),
    ],
)
def test_other_scanners(scanner: dict[str, Any], bound: float, tmp_path: Path) -> None:
    driven = drive(scene("rooms", **(BEAMS | scanner)), 80.0)
    errors = driven.errors(mapped(driven.write(tmp_path / "drive.mcap")))
    assert len(errors.translation) == errors.total > 10
    assert errors.translation.max() < bound


def standing(rooms: Driven, count: int) -> list[Message]:
    """The first scan again and again, with an odometry that stays where it is."""
    scan = scans(rooms.messages)[0]
    stamps = [scan.stamp + 0.1 * k for k in range(count)]
    return [m for t in stamps for m in (Odometry(t, "odom", 1.0, 2.0, 0.5), replace(scan, stamp=t))]


def lone_node(result: MapResult) -> bool:
    return len(result.graph.poses) == 1 and not len(result.graph.pairs)


@pytest.mark.parametrize("count", [1, 300])
def test_a_robot_that_never_moves(rooms: Driven, tmp_path: Path, count: int) -> None:
    """One scan is enough for a map: one node, no edge."""
    write_recording(tmp_path / "stand.mcap", standing(rooms, count))
    result = mapped(tmp_path / "stand.mcap")
    assert lone_node(result)
    assert len(result.trajectory) == count
    assert np.abs(result.trajectory).max() < 0.002
    assert (result.grid.cells == 100).sum() > 50
    assert groma.cli.run(["map", str(tmp_path / "stand.mcap"), "-o", str(tmp_path / "out")]) == 0
    assert len(list((tmp_path / "out").iterdir())) == 8


def refused(path: Path, out: Path, capsys: pytest.CaptureFixture[str], *options: str) -> tuple[int, str]:
    """Exit code and message; nothing may be left behind."""
    code = groma.cli.run(["map", str(path), "-o", str(out), *options])
    assert not out.is_dir() or not list(out.iterdir())
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("groma: ")]
    assert len(told) == 1
    return code, told[0]


def test_without_scans_it_is_the_users_mistake(
    rooms: Driven, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = rooms.write(tmp_path / "drive.mcap", each_scan(lambda _k, _scan: None))
    code, told = refused(path, tmp_path / "out", capsys)
    assert code == 2
    assert "scan" in told


def test_scans_without_an_echo_give_no_map(rooms: Driven, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    nothing = each_scan(lambda _, scan: with_ranges(scan, np.full(181, math.inf)))
    path, out = rooms.write(tmp_path / "drive.mcap", nothing), tmp_path / "out"
    assert groma.cli.run(["map", str(path), "-o", str(out)]) == 1
    assert "error: no-estimate: " in capsys.readouterr().err
    assert {path.name for path in out.iterdir()} == {"metrics.json", "report.html", "run.toml"}
    assert "no scan could be used" in (out / "report.html").read_text()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[map]\nrezolution = 0.1\n", "map.rezolution"),
        ("[map.corners]\nbeat = 2\n", "map.corners.beat"),
        ("[settings.map.corners]\nbeta = '2'\n", "map.corners.beta"),
        ("[map]\ncorners = 3\n", "map.corners"),
        ("[map]\nresolution = 2020-02-02\n", "map.resolution"),
        ("[map]\nresolution = nan\n", "map.resolution"),
        ("[map]\nresolution = 0.0\n", "resolution"),
        ("[map]\nlateness = -1.0\n", "lateness"),
        ("[map]\nonline = 1\n", "map.online"),
        ("[map.corners]\nsectors = true\n", "map.corners.sectors"),
        ("settings = 3\n", "no table [map]"),
        ("[map\n", "is not TOML"),
    ],
)
def test_a_wrong_setting_is_reported_by_its_name(
    rooms: Driven, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, told: str
) -> None:
    (tmp_path / "settings.toml").write_text(text)
    path = rooms.write(tmp_path / "drive.mcap", lambda messages: messages[:50])
    code, message = refused(path, tmp_path / "out", capsys, "--config", str(tmp_path / "settings.toml"))
    assert code == 2
    assert told in message


def test_a_file_is_no_folder_for_results(rooms: Driven, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = rooms.write(tmp_path / "drive.mcap", lambda messages: messages[:50])
    before = path.read_bytes()
    code, told = refused(path, path, capsys)
    assert code == 2
    assert "is a file" in told
    assert path.read_bytes() == before


HOSTILE = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
resource.setrlimit(resource.RLIMIT_CPU, (20, 20))
import groma.cli
raise SystemExit(groma.cli.run(["map", sys.argv[1], "-o", sys.argv[2]]))
"""


def hostile(path: Path, out: Path) -> tuple[int, str]:
    """Map a recording with limits on time and memory; return exit code and standard error."""
    command = [sys.executable, "-c", HOSTILE, str(path), str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    return done.returncode, done.stderr


@pytest.mark.shared
@pytest.mark.parametrize("name", ["incnan1.csv", "inc1e3081.csv", "tf1.mcap"])
def test_hostile_recordings_end_in_time(shared: Path, tmp_path: Path, name: str) -> None:
    code, told = hostile(shared / "cases/hostile" / name, tmp_path / "out")
    assert code in (0, 1, 2), told
    assert "Traceback" not in told
