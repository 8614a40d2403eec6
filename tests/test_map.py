"""`groma map` on simulated drives: the errors, the files, the same bytes again, online, interrupted."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import groma.cli
from drives import Driven, closure_errors, drive, mapped, scene
from groma import _core
from groma.io.g2o import read_g2o
from groma.io.landmarks import read_landmarks
from groma.io.nav2_map import read_map
from groma.io.recording import open_recording
from groma.io.toml import to_toml
from groma.io.trajectory import read_tum
from groma.mapping.mapper import beams, map_drive
from groma.mapping.result import MapResult
from groma.nouns.messages import LaserScan, Odometry
from groma.recordings.drive import open_drive
from groma.runs.reading import Watched

GROMA = Path(sys.executable).with_name("groma")
FILES = {
    "graph.g2o",
    "landmarks.json",
    "map.pgm",
    "map.yaml",
    "metrics.json",
    "report.html",
    "run.toml",
    "trajectory.tum",
}
METRICS = {
    "cells_free",
    "cells_occupied",
    "chi_square_per_dof",
    "closure_correction_max_m",
    "closure_residual_max_deg",
    "closure_residual_max_m",
    "closure_residual_median_m",
    "closures_accepted",
    "closures_rejected",
    "counts",
    "drift_odometry_max_m",
    "drift_tracked_max_m",
    "duration_s",
    "edges",
    "landmarks",
    "map_height_m",
    "map_resolution_m",
    "map_width_m",
    "nodes",
    "path_m",
    "poses",
    "sigma_heading_max_deg",
    "sigma_position_max_m",
    "weak_spots",
}
"""Programs read these: a key may be added, none may go."""


@pytest.fixture(scope="module")
def rooms() -> Driven:
    """200 m through corridors and rooms, around a block and back to the start."""
    return drive(scene("rooms", beams=181, angle_increment=math.radians(1.5), period=0.4), 300.0)


@pytest.fixture(scope="module")
def recording(rooms: Driven, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rooms.write(tmp_path_factory.mktemp("rooms") / "rooms.mcap")


@pytest.fixture(scope="module")
def result(recording: Path) -> MapResult:
    return mapped(recording)


@pytest.fixture(scope="module")
def folder(recording: Path) -> Path:
    """What the command leaves."""
    out = recording.with_name("out")
    run("map", recording, "-o", out, "--threads", "1")
    return out


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([GROMA, *arguments], check=True, capture_output=True, text=True)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_drive_is_mapped_to_a_centimetre_and_its_loop_is_closed(rooms: Driven, result: MapResult) -> None:
    errors = rooms.errors(result)
    assert len(errors.translation) == errors.total > 30
    assert errors.translation.mean() < 0.01
    assert errors.translation.max() < 0.04
    assert errors.rotation.mean() < 0.1
    assert result.counts["scans_used"] == len(rooms.truth.stamps)
    assert result.counts["closures_accepted"] >= 20
    span = max(c.to_stamp - c.from_stamp for c in result.closures if c.accepted)
    assert span > 200


def test_no_closure_contradicts_the_truth(rooms: Driven, result: MapResult) -> None:
    metres, radians = closure_errors(rooms, result)
    assert len(metres) == sum(closure.accepted for closure in result.closures)
    assert metres.max() < 0.1
    assert radians.max() < math.radians(1)


def test_scans_alone_give_as_good_a_map(rooms: Driven, recording: Path) -> None:
    alone = mapped(recording, odometry="none")
    errors = rooms.errors(alone)
    assert errors.translation.mean() < 0.01
    assert alone.counts["odometry_read"] == 0
    assert np.isnan(alone.odometry).all()
    assert len(alone.trajectory) == len(rooms.truth.stamps)


def test_all_files_are_there_and_our_readers_read_them(folder: Path, result: MapResult) -> None:
    assert {path.name for path in folder.iterdir()} == FILES
    trajectory = read_tum(folder / "trajectory.tum")
    assert np.array_equal(trajectory.stamps, np.round(result.trajectory_stamps, 9))
    np.testing.assert_allclose(trajectory.poses[:, :2], result.trajectory[:, :2], atol=1e-9)
    graph = read_g2o(folder / "graph.g2o")
    assert np.array_equal(graph.poses, result.graph.poses)
    np.testing.assert_allclose(graph.information, result.graph.information, rtol=1e-9, atol=1e-6)
    grid = read_map(folder / "map.yaml")
    assert (grid.resolution, grid.origin) == (result.grid.resolution, tuple(result.grid.origin))
    assert np.array_equal(grid.cells, result.grid.cells)
    landmarks = read_landmarks(folder / "landmarks.json")
    assert np.array_equal(landmarks.positions, result.landmarks.positions)
    assert np.array_equal(landmarks.covariances, result.landmarks.covariances)
    assert len(landmarks.positions) > 10


def test_an_odd_resolution_keeps_all_its_digits(recording: Path, tmp_path: Path) -> None:
    assert groma.cli.run(["map", str(recording), "-o", str(tmp_path), "--resolution", "0.0837"]) == 0
    grid = read_map(tmp_path / "map.yaml")
    assert grid.resolution == 0.0837
    assert (grid.cells == 100).sum() > 1000


def test_metrics_keep_their_keys(folder: Path, result: MapResult) -> None:
    metrics = json.loads((folder / "metrics.json").read_text())
    assert set(metrics) >= METRICS
    assert metrics["nodes"] == len(result.graph.poses)
    assert set(metrics["counts"]) >= {"scans_read", "scans_used", "odometry_read", "keyframes", "local_maps"}


def test_the_same_bytes_with_one_and_two_threads(recording: Path, folder: Path, tmp_path: Path) -> None:
    for threads in ("1", "2"):
        run("map", recording, "-o", tmp_path / threads, "--threads", threads)
        assert contents(tmp_path / threads) == contents(folder), f"{threads} threads"


def test_the_same_bytes_from_the_settings_of_a_run(recording: Path, tmp_path: Path) -> None:
    first, again = tmp_path / "first", tmp_path / "again"
    (tmp_path / "some.toml").write_text("[map]\nresolution = 0.1\n[map.corners]\nbeta = 2\n")
    run("map", recording, "-o", first, "--config", tmp_path / "some.toml")
    run("map", recording, "-o", again, "--config", first / "run.toml")
    settings = (first / "run.toml").read_text()
    assert "resolution = 0.1\n" in settings
    assert "beta = 2.0\n" in settings
    assert "range_noise" in settings, "settings that the file leaves out are recorded too"
    named = {name: data.replace(b"again/", b"") for name, data in contents(again).items()}
    typed = (str(tmp_path / "some.toml"), str(first / "run.toml"))
    for name, data in contents(first).items():
        assert data.replace(typed[0].encode(), typed[1].encode()) == named[name], name


def test_settings_that_are_left_out_have_their_defaults(recording: Path, result: MapResult, tmp_path: Path) -> None:
    (tmp_path / "all.toml").write_text(to_toml({"map": json.loads(_core.map_defaults())}))
    out = tmp_path / "out"
    assert groma.cli.run(["map", str(recording), "-o", str(out), "--config", str(tmp_path / "all.toml")]) == 0
    assert np.array_equal(read_g2o(out / "graph.g2o").poses, result.graph.poses)


def test_online_a_pose_uses_only_the_past(rooms: Driven, recording: Path, tmp_path: Path) -> None:
    """The map of the first half gives the first half of the trajectory of the whole, to the last bit."""
    first_half = Driven(rooms.simulated, 151.3).write(tmp_path / "half.mcap")
    half, whole = mapped(first_half, online=True), mapped(recording, online=True)
    count = len(half.trajectory_stamps)
    assert 0.4 < count / len(whole.trajectory_stamps) < 0.6
    assert np.array_equal(half.trajectory_stamps, whole.trajectory_stamps[:count])
    assert np.array_equal(half.trajectory, whole.trajectory[:count])


def test_online_and_offline_differ_where_a_loop_was_closed_later(
    rooms: Driven, recording: Path, result: MapResult
) -> None:
    online = mapped(recording, online=True)
    assert np.abs(online.trajectory - result.trajectory).max() > 1e-4
    assert rooms.errors(online).translation.mean() < 0.02


def test_interrupted_it_finishes_the_map_of_what_was_read(rooms: Driven, recording: Path) -> None:
    token = _core.Token()

    def interrupt(scans: int, *_: int) -> None:
        if scans == 140:
            token.cancel()

    part = map_drive(open_drive(Watched(open_recording(recording), token)), {}, interrupt, token)
    assert part.verdict == "interrupted"
    assert 140 <= part.counts["scans_used"] < 150
    assert part.trajectory_stamps[-1] == pytest.approx(rooms.truth.stamps[139], abs=4.0)
    assert rooms.errors(part).translation.mean() < 0.01


def test_message_by_message_the_core_gives_the_map_of_the_file(recording: Path, result: MapResult) -> None:
    """To the last bit, and with a look at it on the way."""
    opened = open_drive(open_recording(recording))
    core = _core.Mapper(_core.map_defaults(), (opened.mount.x, opened.mount.y, opened.mount.yaw))
    assert core.state() is None
    for k, event in enumerate(opened.events()):
        if isinstance(event, LaserScan):
            core.push_scan(event.stamp, event.ranges, event.intensities, beams(event))
        elif isinstance(event, Odometry):
            core.push_odometry(event.stamp, event.x, event.y, event.theta)
        if k == 1000:
            early = core.snapshot()
    state = core.state()
    assert state is not None
    assert state.covariance.shape == (3, 3)
    arrays = core.finish()
    assert len(early.graph.stamps) < len(arrays.graph.stamps) == state.keyframes
    assert np.array_equal(arrays.graph.poses, result.graph.poses)
    assert np.array_equal(arrays.trajectory, result.trajectory)
    assert np.array_equal(arrays.grid.cells, result.grid.cells)
    assert np.array_equal(arrays.landmarks.positions, result.landmarks.positions)
    assert (arrays.counts, arrays.verdict) == (result.counts, result.verdict)


def processor_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_ctrl_c_leaves_a_finished_map(tmp_path: Path) -> None:
    long = drive(scene("rooms")).write(tmp_path / "long.mcap")
    out = tmp_path / "out"
    process = subprocess.Popen([GROMA, "map", long, "-o", out], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    while not list(tmp_path.glob(".out.groma-*")):  # made right before the first scan is read
        assert process.poll() is None
        time.sleep(0.01)
    begun = processor_seconds(process.pid)
    while processor_seconds(process.pid) < begun + 0.6:  # however busy the machine is: scans are being read by then
        assert process.poll() is None
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGINT)
    told, error = process.communicate(timeout=60)
    assert process.returncode == 0, error
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["verdict"] == "interrupted"
    assert b"warning: interrupted: " in error
    assert told.startswith(b"Interrupted: ")
    assert 0 < metrics["counts"]["scans_read"] < 3067
    assert {path.name for path in out.iterdir()} == FILES


def test_without_a_folder_given_latest_points_to_a_new_one(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert groma.cli.run(["map", str(recording)]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("The map is consistent: ")
    assert Path(told[1]).samefile(tmp_path / "results/latest/report.html")
    assert len(list((tmp_path / "results").iterdir())) == 3, "the run, latest and latest-map"
