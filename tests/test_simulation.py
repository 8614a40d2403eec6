"""Simulated recordings: their messages, their truth, and the command that writes them."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from typing import get_args

import msgspec
import numpy as np
import pytest

from groma import cli
from groma.cli.simulate import Scene
from groma.errors import UserError
from groma.evaluation.relations import evaluate_relations, read_relations
from groma.io.recording import open_recording
from groma.io.trajectory import Trajectory, read_tum, write_tum
from groma.nouns.arrays import Array
from groma.nouns.messages import JointState, LaserScan, Message, Odometry, Transform
from groma.nouns.poses import compose, relative
from groma.simulation.scenes import (
    AGAIN_AFTER,
    AGAIN_WITHIN,
    Scenario,
    Simulated,
    scenario,
    scenes,
    simulate,
    true_relations,
    write_relations,
)


def few_scans(name: str, seed: int = 1) -> Scenario:
    """A named scenario with a scan every four seconds."""
    full = scenario(name, seed)
    return msgspec.structs.replace(full, scanner=msgspec.structs.replace(full.scanner, period=4.0))


@pytest.fixture(scope="module")
def rooms() -> Simulated:
    return simulate(few_scans("rooms"))


def test_messages_come_in_order_of_time_and_tell_their_frames(rooms: Simulated) -> None:
    messages = list(rooms)
    stamps = [message.stamp for message in messages]
    assert stamps == sorted(stamps)
    scans = [m for m in messages if isinstance(m, LaserScan)]
    assert len(scans) == len(rooms.scan_stamps) > 100
    for kind in (Odometry, JointState):
        assert sum(isinstance(m, kind) for m in messages) == len(rooms.stamps) > 10_000
    mount = messages[0]
    assert isinstance(mount, Transform)
    assert (mount.parent, mount.child, mount.static) == ("base_link", "laser", True)
    assert mount.translation[0] == rooms.scenario.scanner.mount[0]
    assert all(m.frame == "laser" and len(m.ranges) == len(m.intensities) == 541 for m in scans)


def test_wheels_turn_as_the_odometry_says(rooms: Simulated) -> None:
    joints = [m for m in rooms if isinstance(m, JointState)]
    times = np.diff([m.stamp for m in joints])
    turned = np.cumsum([m.velocities for m in joints[1:]] * times[:, None], axis=0)
    assert joints[0].names == ("left_wheel_joint", "right_wheel_joint")
    assert np.allclose(turned[-1], rooms.joints[-1], atol=1e-6)
    path = np.hypot(*np.diff(rooms.truth[:, :2], axis=0).T).sum()
    assert rooms.joints[-1].mean() * 0.098 == pytest.approx(path, rel=0.01)


def test_odometry_starts_at_the_truth_and_drifts(rooms: Simulated) -> None:
    placed = compose(rooms.truth[:1], rooms.odometry)
    errors = np.hypot(*(placed - rooms.truth)[:, :2].T)
    assert errors[0] == 0
    assert errors[:250].max() < 0.1
    assert 0.5 < errors.max() < 40


def test_points_lie_on_walls_only_when_each_beam_has_its_own_pose() -> None:
    warehouse = simulate(few_scans("warehouse"))
    speed = np.gradient(np.unwrap(warehouse.truth[:, 2]), warehouse.stamps)
    turning = int(np.argmax(np.abs(np.interp(warehouse.scan_stamps, warehouse.stamps, speed))))
    sigma = warehouse.scenario.scanner.sigma
    assert np.quantile(wall_distances(warehouse, turning, deskew=True), 0.99) < 3.5 * sigma
    assert np.quantile(wall_distances(warehouse, turning, deskew=False), 0.9) > 10 * sigma


def wall_distances(simulated: Simulated, scan: int, *, deskew: bool) -> Array:
    """Distances of the points of a scan to the nearest surface [m]."""
    laser, ranges = simulated.scenario.scanner, simulated.ranges[scan]
    index = np.flatnonzero(np.isfinite(ranges))
    bearings = laser.angle_min + index * laser.angle_increment
    local = ranges[index, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    times = simulated.scan_stamps[scan] + index * (laser.time_increment if deskew else 0.0)
    truth = np.column_stack([simulated.truth[:, :2], np.unwrap(simulated.truth[:, 2])])
    base = np.column_stack([np.interp(times, simulated.stamps, column) for column in truth.T])
    points = compose(compose(base, np.array(laser.mount)), np.column_stack([local, np.zeros(len(local))]))
    return np.array([nearest_surface(simulated, point) for point in points[:, :2]])


def nearest_surface(simulated: Simulated, point: Array) -> float:
    a, b = simulated.segments[:, :2], simulated.segments[:, 2:4]
    share = ((point - a) * (b - a)).sum(axis=1) / np.maximum(((b - a) ** 2).sum(axis=1), 1e-12)
    feet = a + np.clip(share, 0, 1)[:, None] * (b - a)
    circles = np.abs(np.hypot(*(point - simulated.circles[:, :2]).T) - simulated.circles[:, 2])
    return float(min(np.hypot(*(point - feet).T).min(), circles.min()))


def test_relations_hold_for_the_truth_and_cover_places_seen_again(rooms: Simulated, tmp_path: Path) -> None:
    relations = true_relations(rooms.scan_stamps, rooms.scan_truth)
    spans = relations.times[:, 1] - relations.times[:, 0]
    again = spans > AGAIN_AFTER
    assert again.sum() > 30
    assert (spans[~again] <= 8).all()
    assert (spans > 0).all()
    assert (np.hypot(*relations.poses[again, :2].T) <= AGAIN_WITHIN).all()
    write_relations(tmp_path / "rooms.relations", relations)
    read = read_relations(tmp_path / "rooms.relations")
    assert read.planar
    errors = evaluate_relations(read, Trajectory(rooms.stamps, rooms.truth))
    assert len(errors.translation) == len(relations.times)
    assert errors.translation.max() < 1e-6
    assert errors.worst_gap < 1e-6
    drifted = evaluate_relations(read, Trajectory(rooms.stamps, rooms.odometry))
    assert drifted.translation.max() > 0.5


@pytest.mark.shared
def test_the_benchmark_tool_finds_the_truth_true(rooms: Simulated, tmp_path: Path, shared: Path) -> None:
    write_tum(tmp_path / "truth.tum", rooms.stamps, rooms.truth)
    write_relations(tmp_path / "r", true_relations(rooms.scan_stamps, rooms.scan_truth))
    tool = [sys.executable, str(shared.resolve() / "tools/slam_relations_eval.py"), "r", "truth.tum", "--json"]
    result = msgspec.json.decode(subprocess.run(tool, cwd=tmp_path, check=True, capture_output=True).stdout)
    assert result["relations_evaluated"] == result["relations_total"] > 100
    assert result["max_trans_m"] < 1e-6


def test_the_named_scenarios_differ_where_they_say() -> None:
    assert scenes() == list(get_args(Scene))
    rooms, stalls, turns, loop = (scenario(name) for name in ("rooms", "stalls", "turns", "loop"))
    assert rooms.stalls == 0 < stalls.stalls
    assert (stalls.scanner.period, stalls.stall_duration) == (0.2, 1.0)
    assert np.degrees(turns.limits.turn_rate * turns.scanner.period) > 40
    assert (loop.scanner.period, loop.wheels.final_error) == (2.0, 30.0)


def test_mistakes_are_reported_in_one_line() -> None:
    with pytest.raises(UserError, match='no scene is called "attic": try one of rooms, warehouse'):
        scenario("attic")
    rooms = scenario("rooms")
    wrong = {
        "limits.speed = -1": msgspec.structs.replace(rooms, limits=msgspec.structs.replace(rooms.limits, speed=-1.0)),
        "attic": msgspec.structs.replace(rooms, building="attic"),
        "touches something": msgspec.structs.replace(rooms, clearance=0.6),
    }
    for text, bad in wrong.items():
        with pytest.raises(UserError, match=text) as error:
            simulate(bad)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", [".csv.gz", ".mcap"])
def test_the_command_writes_the_same_bytes_twice(tmp_path: Path, suffix: str) -> None:
    names = ["t" + suffix, "t-truth.tum", "t.relations"]
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        assert cli.run(["simulate", "turns", "-o", str(tmp_path / folder / names[0]), "--seed", "5"]) == 0
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_the_command_writes_what_was_simulated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["simulate", "turns", "-o", str(tmp_path / "t.csv"), "--seed", "2"]) == 0
    assert "scans" in capsys.readouterr().out
    turns = simulate(scenario("turns", 2))
    truth = read_tum(tmp_path / "t-truth.tum")
    assert np.allclose(truth.stamps, turns.stamps, atol=1e-9)
    assert np.allclose(relative(truth.poses, turns.truth), 0, atol=1e-8)
    read, made = list(open_recording(tmp_path / "t.csv").messages()), list(turns)
    assert len(read) == len(made)
    assert all(same(a, b) for a, b in zip(read[:2000], made[:2000], strict=True))


def same(a: Message, b: Message) -> bool:
    """Whether two messages agree to the digits of a text file."""
    pairs = [(getattr(a, field.name), getattr(b, field.name)) for field in fields(b)]
    numbers = [(x, y) for x, y in pairs if isinstance(y, float | np.ndarray)]
    return type(a) is type(b) and all(np.allclose(x, y, atol=1e-6, equal_nan=True) for x, y in numbers)


@pytest.mark.parametrize("arguments", [["rooms", "-o", "x.bag"], ["rooms", "-o", "x.csv", "--seed", "-1"], ["attic"]])
def test_the_command_refuses_in_one_line(arguments: list[str]) -> None:
    assert cli.run(["simulate", *arguments]) == 2
