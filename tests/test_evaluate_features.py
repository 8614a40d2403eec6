"""Repeatability of keypoints: exact where the answer is known, refused where there is none, and the reached figures."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import groma.cli
from groma.evaluation.feature_landmarks import sightings
from groma.evaluation.feature_scans import PosedScans, read_posed_scans
from groma.evaluation.feature_visibility import MARGIN, Views
from groma.evaluation.features import Detect, Repeatability, evaluate_features, repeatability
from groma.features.corners import falko_batch
from groma.io.recording import open_recording, write_recording
from groma.io.trajectory import write_tum
from groma.mapping.mapper import map_defaults, map_drive
from groma.nouns.messages import BeamGeometry, LaserScan, Message, Odometry
from groma.nouns.poses import compose, relative
from groma.recordings.drive import open_drive

Array = NDArray[np.float64]

GEOMETRY = BeamGeometry(-math.pi / 2, math.pi / 360, 0.0, 0.1, 20.0)
BEARINGS = GEOMETRY.angle_min + GEOMETRY.angle_increment * np.arange(361)
ROOM = np.array([[6.0, -3], [6, 4], [-2, 4], [-2, -3]])
"""Corners of a room."""


KEYS = {
    *("recording", "poses", "scans_total", "scans", "scans_without_pose", "keypoints", "keypoints_per_scan", "pairs"),
    *("repeatability", "repeatability_backward", "landmarks", "landmarks_seen_once", "ephemeral_share"),
    *("time_per_scan_s", "threads"),
}


def polygon(corners: Array) -> Array:
    """Its walls (W, 2, 2)."""
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def cast(walls: Array, pose: Sequence[float], stamp: float = 0.0) -> LaserScan:
    """A scan without noise of walls (W, 2, 2)."""
    bearing = BEARINGS + pose[2]
    ray = np.stack([np.cos(bearing), np.sin(bearing)], axis=1)[:, None]
    start, along = walls[:, 0] - pose[:2], walls[:, 1] - walls[:, 0]
    det = ray[..., 0] * along[:, 1] - ray[..., 1] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        rho = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / det
        share = (start[:, 0] * ray[..., 1] - start[:, 1] * ray[..., 0]) / det
    ranges = np.where((rho > 0) & (share >= 0) & (share <= 1), rho, np.inf).min(axis=1)
    return LaserScan(stamp, "/scan", "laser", GEOMETRY, ranges)


def seen_from(points: Array, pose: Sequence[float]) -> Array:
    flat = np.pad(points, ((0, 0), (0, 1)))
    return relative(np.broadcast_to(np.array(pose), flat.shape), flat)[:, :2]


def drive(walls: Array, poses: Array) -> PosedScans:
    scans = [cast(walls, pose, float(k)) for k, pose in enumerate(poses.tolist())]
    return PosedScans("room", "truth", scans, poses, len(scans), 0)


def line(count: int, step: float) -> Array:
    return np.column_stack([step * np.arange(count), np.zeros(count), np.zeros(count)])


def measured(scans: PosedScans, points: list[Array], backward: bool = False) -> Repeatability:
    return repeatability(Views(scans.scans), scans.poses, points, backward)


@pytest.mark.parametrize("backward", [False, True])
def test_keypoints_that_stay_are_all_found_again_and_not_by_chance(backward: bool) -> None:
    scans = drive(polygon(ROOM), np.array([[0, 0, 0.3], [0.5, 0, -0.2], [1, 0.5, 0.1]]))
    way = measured(scans, [seen_from(ROOM[:2], pose) for pose in scans.poses.tolist()], backward)
    assert (way.pairs, len(way.distance)) == (3, 6)
    assert way.distance.max() < 1e-12
    assert (way.raw(0.1), way.chance(0.1), way.corrected(0.1)) == (1, 0, 1)


def test_keypoints_that_wander_are_found_again_only_within_the_tolerance() -> None:
    scans = drive(polygon(ROOM), line(2, 0.5))
    wandered = seen_from(ROOM[:2], [0.35, 0, 0])
    way = measured(scans, [ROOM[:2], wandered])
    np.testing.assert_allclose(way.distance, 0.15)
    assert (way.raw(0.1), way.raw(0.2)) == (0, 1)
    assert measured(scans, [ROOM[:2], np.empty((0, 2))]).raw(0.2) == 0


def test_chance_is_what_a_prediction_moved_along_the_scan_finds() -> None:
    scans = drive(polygon(ROOM), line(2, 0.5))
    there = np.array([4.0, 0.3])
    ahead = LaserScan(1.0, "/scan", "laser", GEOMETRY, np.full(361, math.hypot(*there)))
    scans = PosedScans("arc", "truth", [scans.scans[0], ahead], scans.poses, 2, 0)
    chord = 2 * math.asin(0.3 / math.hypot(*there))
    c, s = math.cos(chord), math.sin(chord)
    beside = np.array([[c, -s], [s, c]]) @ there
    assert math.dist(beside, there) == pytest.approx(0.6)
    way = measured(scans, [there[None] + [0.5, 0], np.array([there, beside])])
    assert (way.raw(0.1), way.chance(0.1), way.corrected(0.1)) == (1, 0.5, 1)
    way = measured(scans, [there[None] + [0.5, 0], beside[None]])
    assert (way.raw(0.1), way.chance(0.1), way.corrected(0.1)) == (0, 0.5, -1)


def test_a_detector_that_fires_everywhere_finds_as_much_by_chance() -> None:
    scans = drive(polygon(ROOM), line(4, 0.4))
    points = [s.ranges[:, None] * np.column_stack([np.cos(BEARINGS), np.sin(BEARINGS)]) for s in scans.scans]
    way = measured(scans, points)
    assert way.raw(0.1) > 0.95
    assert way.chance(0.1) > 0.99


def test_what_is_hidden_behind_something_does_not_count() -> None:
    corner, screen = ROOM[1:2], np.array([[[2.0, -2], [2, 2]]])
    poses = np.array([[0, 0, 0], [0, 1.9, 0]])
    points = [seen_from(corner, pose) for pose in poses.tolist()]
    for walls, visible in ((polygon(ROOM), (1, 1)), (np.concatenate([polygon(ROOM), screen]), (1, 0))):
        ways = [measured(drive(walls, poses), points, backward) for backward in (False, True)]
        assert tuple(len(way.distance) for way in ways) == visible


def test_visible_is_inside_the_fan_and_the_ranges_and_not_behind_the_surface() -> None:
    ranges = np.full(361, 5.0)
    ranges[100] = np.inf
    ranges[200:203] = np.nan
    views = Views([LaserScan(0, "/scan", "laser", replace(GEOMETRY, range_max=8.0), ranges)])

    def visible(rho: float, phi: float) -> bool:
        return bool(views.visible(np.array([0]), np.array([rho]), np.array([phi]))[0])

    assert visible(5.0, 0.3)
    assert visible(5.0 + 0.99 * MARGIN, 0.3)
    assert not visible(5.0 + 1.01 * MARGIN, 0.3)
    assert not visible(0.09, 0.3)
    step = GEOMETRY.angle_increment
    assert visible(4.0, math.pi / 2 + 0.49 * step)
    assert not visible(4.0, math.pi / 2 + 0.51 * step)
    assert not visible(4.0, math.pi)
    assert [visible(7.9, BEARINGS[k]) for k in (98, 99, 100, 101, 102)] == [False, True, True, True, False]
    assert not visible(8.1, BEARINGS[100])
    assert [visible(4.0, BEARINGS[k]) for k in (200, 201, 202)] == [True, False, True]


def test_the_seam_of_a_full_circle_is_in_the_fan() -> None:
    around = BeamGeometry(0.0, math.pi / 180, 0.0, 0.1, 20.0)
    scans = [
        LaserScan(0, "/scan", "laser", around, np.arange(360.0)),
        LaserScan(0, "/scan", "laser", GEOMETRY, np.ones(361)),
    ]
    views = Views(scans)
    bearings = np.radians([0.0, 359.0, -1.0, 181.0, -179.0, 0.4])
    assert views.beams(np.zeros(6, dtype=np.int64), bearings).tolist() == [0, 359, 359, 181, 181, 0]
    assert views.beams(np.ones(2, dtype=np.int64), np.array([0.0, math.pi])).tolist() == [180, -1]


@pytest.mark.parametrize(
    ("count", "step", "lags"),
    [(30, 0.19, range(2, 11)), (60, 0.041, range(8, 41)), (5, 2.5, range(0))],
    ids=["2 m", "40 scans", "none"],
)
def test_pairs_are_near_in_space_and_in_order(count: int, step: float, lags: range) -> None:
    way = measured(drive(polygon(ROOM), line(count, step)), [ROOM[:1]] * count)
    assert way.pairs == sum(count - lag for lag in lags)


def test_where_chance_finds_all_there_is_nothing_to_correct() -> None:
    assert math.isnan(Repeatability(np.zeros(3), np.zeros(3), 1).corrected(0.1))


def test_landmarks_are_counted_by_scans() -> None:
    points = np.array([[0.0, 0], [0.1, 0], [5, 5], [0.05, 0], [0.19, 0], [0.3, 0], [-0.01, -0.01]])
    scan = np.array([0, 0, 0, 1, 2, 3, 4])
    # The first two are of one scan: one sighting. Places stay where they were first seen: 0.3 is a landmark of its own.
    assert sightings(points, scan).tolist() == [4, 1, 1]
    assert sightings(np.empty((0, 2)), np.empty(0, dtype=np.int64)).tolist() == []


def test_a_keypoint_joins_the_nearest_landmark_across_cells() -> None:
    points = np.array([[0.19, 0.19], [0.45, 0.19], [0.33, 0.21], [0.21, 0.21]])
    assert sightings(points, np.arange(4)).tolist() == [2, 2]


def test_falko_repeats_the_corners_of_a_room_without_noise() -> None:
    poses = np.column_stack([np.linspace(0, 2, 9), np.linspace(-0.5, 0.5, 9), np.linspace(-0.3, 0.3, 9)])
    found = evaluate_features(drive(polygon(ROOM), poses))
    assert 2 <= found.keypoints_per_scan < 2.5  # beams of equal score beside a corner are two keypoints
    for way in (found.forward, found.backward):
        assert (way.raw(0.1), way.chance(0.1), way.corrected(0.1)) == (1, 0, 1)
    assert found.sightings.tolist() == [9, 9]
    assert found.ephemeral_share == 0
    assert found.seconds_per_scan > 0


def test_nothing_is_repeated_under_wrong_poses() -> None:
    true = drive(polygon(ROOM), line(2, 0.5))
    wrong = PosedScans("room", "wrong", true.scans, true.poses + np.array([[0, 0, 0], [0, 0.5, 0]]), 2, 0)
    found = evaluate_features(wrong)
    assert (found.forward.raw(0.2), found.backward.raw(0.2)) == (0, 0)
    assert found.ephemeral_share == 1


def test_recordings_may_mix_fans() -> None:
    scans = drive(polygon(ROOM), line(6, 0.4))
    mixed = [s if k % 2 else _without_first_beams(s, 40) for k, s in enumerate(scans.scans)]
    found = evaluate_features(PosedScans("room", "truth", mixed, scans.poses, 6, 0))
    assert (found.forward.raw(0.1), found.backward.raw(0.1)) == (1, 1)


def _without_first_beams(scan: LaserScan, count: int) -> LaserScan:
    first = scan.geometry.angle_min + count * scan.geometry.angle_increment
    return replace(scan, geometry=replace(scan.geometry, angle_min=first), ranges=scan.ranges[count:])


def recorded(path: Path, poses: Array, odometry: bool = True, walls: Array | None = None) -> Path:
    """Write a drive through a room as a recording."""
    messages: list[Message] = []
    for k, pose in enumerate(poses.tolist()):
        if odometry:
            messages.append(Odometry(float(k), "/odom", *pose))
        messages.append(cast(polygon(ROOM) if walls is None else walls, pose, float(k)))
    write_recording(path, messages)
    return path


def test_the_command_tells_figures_with_stable_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = recorded(tmp_path / "room.csv", line(12, 0.2))
    out = tmp_path / "out"
    assert groma.cli.run(["evaluate", "features", str(log), "--every", "2", "--json", "-o", str(out)]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures == json.loads((out / "metrics.json").read_text("utf-8"))
    assert figures["protocol"]["every"] == 2
    assert set(figures) == {"kind", "verdict", "findings", "protocol", "falko", "recordings"}
    (room,) = figures["recordings"]
    assert set(room) == KEYS
    assert (room["scans_total"], room["scans"], room["scans_without_pose"]) == (12, 6, 0)
    assert (room["landmarks"], room["ephemeral_share"]) == (2, 0)
    for way in ("repeatability", "repeatability_backward"):
        assert room[way]["tolerance_m"] == {eps: {"raw": 1, "chance": 0, "corrected": 1} for eps in ("0.1", "0.2")}
    page = (out / "report.html").read_text("utf-8")
    assert page.count("<svg") == 1
    assert "http:" not in page.replace("http://www.w3.org/1999/xlink", "")
    assert "<script" not in page


def test_the_command_prints_a_row_for_each_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logs = [str(recorded(tmp_path / name, line(6, 0.4))) for name in ("one.csv", "two.csv")]
    assert groma.cli.run(["evaluate", "features", *logs, "--every", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [row.split()[0] for row in lines if ".csv" in row] == logs * 3
    assert next(row for row in lines if "one.csv" in row).split()[1] == "6"


def test_given_poses_stand_in_for_the_odometry(tmp_path: Path) -> None:
    poses = line(6, 0.4)
    log = recorded(tmp_path / "room.csv", poses, odometry=False)
    write_tum(tmp_path / "poses.tum", np.arange(4.0), compose(np.array([5.0, 5, 1]), poses[:4]))
    read = read_posed_scans(open_recording(log), tmp_path / "poses.tum", 1)
    assert (len(read.scans), read.without_pose, read.total) == (4, 2, 6)
    assert evaluate_features(read).forward.raw(0.1) == 1


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        ([], 2, "at least one recording"),
        (["room.csv", "room.csv", "--poses", "poses.tum"], 2, "one by one"),
        (["room.csv", "--every", "0"], 2, "at least 1"),
        (["absent.csv"], 2, "no such file"),
        (["still.csv"], 1, "nothing to repeat"),
        (["blind.csv"], 1, "0 keypoints"),
        (["no_odometry.csv"], 2, "--poses"),
        (["room.csv", "--poses", "late.tum"], 2, "no scan has a pose"),
        (["room.csv", "--poses", "absent.tum"], 2, "absent.tum"),
    ],
)
def test_mistakes_are_reported_in_one_line(
    arguments: list[str],
    code: int,
    says: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    recorded(tmp_path / "room.csv", line(6, 0.4))
    recorded(tmp_path / "no_odometry.csv", line(6, 0.4), odometry=False)
    recorded(tmp_path / "still.csv", line(6, 0.0))
    recorded(tmp_path / "blind.csv", line(12, 0.4), walls=np.array([[[-99.0, -1], [-98, -1]]]))
    write_tum(tmp_path / "late.tum", np.array([100.0, 101.0]), np.zeros((2, 3)))
    assert groma.cli.run(["evaluate", "features", "-o", "out", *arguments]) == code
    assert Path("out").exists() == (code == 1), "a mistake leaves nothing; no estimate leaves its report"
    (told, *_) = capsys.readouterr().err.splitlines()
    assert told.startswith("groma: " if code == 2 else "error: no-estimate: ")
    assert says in told


def test_a_file_in_the_place_of_the_folder_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = recorded(tmp_path / "room.csv", line(6, 0.4))
    before = log.read_bytes()
    assert groma.cli.run(["evaluate", "features", str(log), "--every", "1", "-o", str(log)]) == 2
    assert "not a folder" in capsys.readouterr().err
    assert log.read_bytes() == before


@pytest.mark.shared
def test_figures_on_intel(shared: Path) -> None:
    """An independent run of the protocol gave for the published definition R 0.489, corrected 0.449, 24 % seen once."""
    scans = read_posed_scans(open_recording(shared / "data" / "intel" / "intel-lab.flirt.log.gz"), None, 3)
    assert (scans.total, len(scans.scans), scans.without_pose) == (2672, 891, 0)
    published = evaluate_features(scans, partial(falko_batch, definition="published"))
    assert published.keypoints_per_scan == pytest.approx(2.513, abs=0.01)
    assert published.forward.raw(0.1) == pytest.approx(0.493, abs=0.005)
    assert published.forward.corrected(0.1) == pytest.approx(0.449, abs=0.005)
    assert published.forward.corrected(0.2) == pytest.approx(0.475, abs=0.005)
    assert published.backward.corrected(0.1) == pytest.approx(0.335, abs=0.005)
    assert published.ephemeral_share == pytest.approx(0.244, abs=0.005)
    normalised = evaluate_features(scans)
    assert normalised.keypoints_per_scan == pytest.approx(2.49, abs=0.01)
    assert normalised.forward.corrected(0.1) == pytest.approx(0.496, abs=0.005)
    assert normalised.forward.corrected(0.2) == pytest.approx(0.534, abs=0.005)
    assert normalised.backward.corrected(0.1) == pytest.approx(0.358, abs=0.005)
    assert normalised.ephemeral_share == pytest.approx(0.213, abs=0.005)


@pytest.mark.shared
def test_figures_on_csail(shared: Path, tmp_path: Path) -> None:
    """Poses are those of our map; every sixth scan is as dense as every third of the log with corrected poses.

    An independent run on that log gave R 0.409, corrected 0.339, 43 % seen once.
    """
    log = shared / "data" / "mit-csail" / "mit-csail.flaser.clf.gz"
    result = map_drive(open_drive(open_recording(log)), map_defaults())
    write_tum(tmp_path / "poses.tum", result.trajectory_stamps, result.trajectory)
    published: Detect = partial(falko_batch, definition="published")
    for detect, keypoints, every, corrected, once in (
        (published, 4.92, 3, 0.376, 0.344),
        (published, 4.92, 6, 0.334, 0.461),
        (falko_batch, 4.19, 3, 0.397, 0.319),
        (falko_batch, 4.19, 6, 0.378, 0.459),
    ):
        found = evaluate_features(read_posed_scans(open_recording(log), tmp_path / "poses.tum", every), detect)
        assert found.keypoints_per_scan == pytest.approx(keypoints, abs=0.05)
        assert found.forward.corrected(0.1) == pytest.approx(corrected, abs=0.03)
        assert found.ephemeral_share == pytest.approx(once, abs=0.03)
