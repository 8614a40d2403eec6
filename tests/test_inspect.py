from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent / "io"))

from made import Ros, bag1, drive_entries, drive_lines, flaser, text

from groma.cli import run
from groma.io.recording import open_recording
from groma.recordings.inspection import Inspection, Timing, inspect


def found(path: Path) -> Inspection:
    return inspect(open_recording(path))


def test_timing() -> None:
    timing = Timing()
    for stamp in [0.0, 0.1, 0.2, 0.3, 0.4, 5.0, 5.1, 5.1, 4.9, 5.2]:
        timing.add(stamp)
    assert (timing.count, timing.backward, timing.repeats) == (10, 1, 1)
    assert timing.largest_back_s == pytest.approx(0.2)
    assert timing.longest_gap_s == pytest.approx(4.6)
    assert timing.rate_hz == pytest.approx(10)
    assert timing.has_gap


def test_a_regular_stream_has_no_gap() -> None:
    timing = Timing()
    for k in range(100):
        timing.add(2.0 * k)
    assert timing.rate_hz == pytest.approx(0.5)
    assert not timing.has_gap


def test_a_carmen_log(tmp_path: Path) -> None:
    lines = [*drive_lines(10, [1.0, -1.0, 0.0, "inf"]), "NEFF 3\n"]
    result = found(text(tmp_path / "a.log", lines))
    scan = result.scans["FLASER"]
    assert (scan.readings, scan.hits, scan.no_returns, scan.invalid) == (40, 10, 10, 20)
    assert result.odometry["FLASER"].path_m == pytest.approx(0.9)
    assert result.duration_s == pytest.approx(9)
    assert result.edges == {("base_link", "laser"): True}
    assert {use.command: use.possible for use in result.uses} == {"groma map": True, "groma calibrate vehicle": True}


def test_the_joints_of_a_bag_are_named(tmp_path: Path) -> None:
    result = found(bag1(tmp_path / "a.bag", drive_entries(Ros(1), 10)))
    assert {use.command: use.possible for use in result.uses} == {"groma map": True, "groma calibrate vehicle": True}
    assert result.joints == {"/joint_states": ("left", "right")}


@pytest.mark.parametrize(("offset", "told"), [(0.0, False), (1000.0, True)])
def test_clocks_that_differ_are_told(tmp_path: Path, offset: float, told: bool) -> None:
    ros = Ros(1)
    entries = [("/scan", k + 1.0, ros.scan(k + 1.0, [1.0])) for k in range(5)]
    entries += [("/odom", k + 1.0, ros.odometry(k + 1.0 + offset, 0.0, 0.0, 0.0)) for k in range(5)]
    result = found(bag1(tmp_path / "a.bag", entries))
    assert any(found.code == "clocks-differ" for found in result.findings) == told


def test_jumps_and_nan_poses(tmp_path: Path) -> None:
    poses = [(0, 0, 0), (0.1, 0, 0), (5.0, 0, 0), ("nan", 0, 0), (5.1, 0, 0)]
    lines = [flaser(laser=p, robot=p, times=f"{k / 10 + 1} h 0") for k, p in enumerate(poses)]  # type: ignore[arg-type]
    result = found(text(tmp_path / "a.log", lines))
    odometry = result.odometry["FLASER"]
    assert odometry.jumps == 1
    assert any(remark.code == "values-invalid" for remark in result.findings)
    assert odometry.largest_step_m == pytest.approx(4.9)
    assert odometry.path_m == pytest.approx(5.1)


def test_the_fence_post_in_words_and_in_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ros = Ros(1)
    entries = [("/scan", k + 1.0, ros.scan(k + 1.0, [1.0] * 360, angle_max=-1.0 + 3.6)) for k in range(3)]
    path = bag1(tmp_path / "a.bag", entries)
    assert run(["inspect", str(path)]) == 0
    assert "angle_max counts one beam too many" in capsys.readouterr().out
    assert run(["inspect", str(path), "--json"]) == 0
    (scan,) = json.loads(capsys.readouterr().out)["scans"]
    assert scan["angle_max_excess_beams"] == pytest.approx(1, abs=1e-3)
    assert "one beam too many" in scan["angle_max_remark"]


JSON_KEYS = {
    "path",
    "format",
    "duration_s",
    "streams",
    "scans",
    "odometry",
    "joints",
    "frames",
    "drive",
    "findings",
    "uses",
}


def test_json_keys_are_stable_and_values_are_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ros = Ros(1)
    scan = ros.scan(1.0, [1.0, np.inf], range_max=np.inf)
    path = bag1(tmp_path / "a.bag", [("/scan", 1.0, scan), *drive_entries(ros, 2)])
    assert run(["inspect", "--json", str(path)]) == 0
    told = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert set(told) == JSON_KEYS
    assert told["scans"][0]["range_max_m"] == pytest.approx(81.7)  # what is taken where a scan says nothing of use
    assert {s["kind"] for s in told["streams"]} == {"laser scan", "odometry", "joint state", "transform"}


def test_piped_text_is_plain(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["inspect", str(text(tmp_path / "a.log", drive_lines(10)))]) == 0
    out, err = capsys.readouterr()
    assert "\x1b" not in out
    assert err == ""
    assert out.isascii()
    assert "groma map" in out
    assert all(line == line.rstrip() for line in out.splitlines())


@pytest.mark.parametrize("content", [b"", bytes(range(256)) * 4, b"\x1f\x8b\x08", b"hello\n"])
def test_what_is_no_recording_ends_with_2_and_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes
) -> None:
    (tmp_path / "a.log").write_bytes(content)
    assert run(["inspect", str(tmp_path / "a.log")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("groma: ")
    assert err.count("\n") == 1


def test_a_folder_that_is_no_bag_ends_with_2(tmp_path: Path) -> None:
    assert run(["inspect", str(tmp_path)]) == 2


def test_a_log_in_which_no_line_is_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["inspect", str(text(tmp_path / "a.log", ["FLASER 3 1 2\n"] * 7))]) == 0
    out = capsys.readouterr().out
    assert "7 malformed and left out: " in out
    assert "a.log:1: FLASER" in out
    assert "lacks laser scans" in out


@pytest.mark.shared
def test_shared_files_end_with_0_or_2(shared: Path, capsys: pytest.CaptureFixture[str]) -> None:
    places = [
        "radish-corrected/edmonton-corrected.log.gz",
        "bags/evo_nav2_turtlebot.mcap",
        "bags/converted/tb3_sqlite3",
    ]
    for place in places:
        assert run(["inspect", "--json", str(shared / "data" / place)]) == 0
        assert json.loads(capsys.readouterr().out)["streams"]
    assert run(["inspect", str(shared / "data/intel/intel.rawlog")]) == 2
    assert "MRPT rawlog" in capsys.readouterr().err
