"""The wheels of a recording: chosen, sorted, unrolled, broken where they must be, and refused in one line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from groma.errors import UserError
from groma.io.counters import Counter
from groma.io.recording import Recording, open_recording, write_recording
from groma.nouns.messages import JointState, Message, Odometry
from groma.nouns.vehicle import Vehicle
from groma.recordings.wheels import Wheels, read_wheels, steers

TIMES = np.arange(0, 10, 0.1)


def joints(stamp: float, names: tuple[str, ...], *positions: float) -> JointState:
    return JointState(stamp, "joint_states", names, np.array(positions), np.full(len(names), np.nan))


def recording(folder: Path, messages: Iterable[Message]) -> Recording:
    write_recording(folder / "wheels.csv", messages)
    return open_recording(folder / "wheels.csv")


def test_joints_are_reported_by_their_names(tmp_path: Path) -> None:
    names = ("lift", "front_steering_joint", "front_drive_joint")
    opened = recording(tmp_path, [joints(t, names, 9.0, 0.1 * t, 2.0 * t) for t in TIMES])
    assert steers(opened)
    read = read_wheels(opened, "tricycle")
    assert read.joints == ("front_drive_joint", "front_steering_joint")
    assert np.allclose(read.readings, np.column_stack([2 * TIMES, 0.1 * TIMES]))
    with pytest.raises(UserError, match="0 may be the left joint"):
        read_wheels(opened, "differential")


def test_left_and_right_may_be_single_letters(tmp_path: Path) -> None:
    opened = recording(tmp_path, [joints(t, ("wheel_r", "wheel_l"), t, 2 * t) for t in TIMES])
    assert not steers(opened)
    assert read_wheels(opened, "differential").joints == ("wheel_l", "wheel_r")
    assert read_wheels(opened, "differential", joints=("wheel_r", "wheel_l")).joints == ("wheel_r", "wheel_l")
    with pytest.raises(UserError, match="--joints names the left and the right joint"):
        read_wheels(opened, "differential", joints=("wheel_r", "wheel_x"))


def test_joints_in_messages_of_their_own_are_brought_together(tmp_path: Path) -> None:
    messages: list[Message] = []
    for t in TIMES:
        messages += [joints(t, ("drive",), 3 * t), joints(t + 0.04, ("steer",), 0.2 * t)]
    read = read_wheels(recording(tmp_path, messages), "tricycle")
    assert np.allclose(read.readings[:, 1], 0.2 * (read.time - 0.04))


def found(read: Wheels) -> dict[str, float]:
    """Counts of what the core found, by code."""
    return {f.code: next(iter(f.values.values()))[0] for f in read.findings if f.code != "joints-chosen"}


def test_late_readings_are_sorted_and_repeated_ones_left_out(tmp_path: Path) -> None:
    order = [0, 1, 3, 2, 4, 4, 5, 6]
    messages = [joints(float(k), ("left", "right"), 1.0 * k, 2.0 * k) for k in order]
    messages.append(joints(7.0, ("left", "right"), np.nan, 1.0))
    read = read_wheels(recording(tmp_path, messages), "differential")
    assert read.time.tolist() == [0, 1, 2, 3, 4, 5, 6]
    counts = found(read)
    assert set(counts) == {"stamps-disordered", "stamps-invalid", "values-invalid"}
    assert counts["values-invalid"] == 1
    assert any("up to 1.000 s late" in f.text for f in read.findings)


def test_angles_that_roll_over_are_unrolled(tmp_path: Path) -> None:
    angle = 2.0 * TIMES
    rolled = np.arctan2(np.sin(angle), np.cos(angle))
    read = read_wheels(
        recording(tmp_path, [joints(t, ("left", "right"), a, b) for t, a, b in zip(TIMES, rolled, angle, strict=True)]),
        "differential",
    )
    assert np.allclose(np.diff(read.readings, axis=0), 0.2)


def test_a_reset_and_a_gap_break_the_log(tmp_path: Path) -> None:
    counts = np.where(TIMES < 4.95, 100 + TIMES, TIMES - 5.0)
    messages = [joints(t, ("left", "right"), c, t) for t, c in zip(TIMES, counts, strict=True) if not 7.05 < t < 8.95]
    read = read_wheels(recording(tmp_path, messages), "differential")
    assert np.allclose(read.breaks, [[4.9, 5.0], [7.0, 9.0]])
    assert found(read) == {"wheels-leap": 1, "wheels-gap": 1}


def test_odometry_stands_still_across_a_reset(tmp_path: Path) -> None:
    counts = np.where(TIMES < 4.95, 100 + TIMES, TIMES - 5.0)
    messages = [joints(t, ("left", "right"), c, c) for t, c in zip(TIMES, counts, strict=True)]
    read = read_wheels(recording(tmp_path, messages), "differential")
    common = dict.fromkeys(("laser_x", "laser_y", "laser_yaw", "delay"), 0.0)
    cart = Vehicle("differential", {"left_radius": 0.1, "right_radius": 0.1, "axle": 0.5, **common})
    along = read.dead_reckoning(cart)[:, 0]
    assert along[-1] == pytest.approx(0.1 * (len(TIMES) - 2) * 0.1)
    assert np.diff(along).max() == pytest.approx(0.01)


def test_speeds_alone_are_refused_in_one_line(tmp_path: Path) -> None:
    messages = [joints(t, ("left", "right"), np.nan, np.nan) for t in TIMES]
    with pytest.raises(UserError, match="have no positions"):
        read_wheels(recording(tmp_path, messages), "differential")


def test_odometry_represents_wheels(tmp_path: Path) -> None:
    turn, speed = 0.3, 0.8
    theta = turn * TIMES
    x, y = speed / turn * np.sin(theta), speed / turn * (1 - np.cos(theta))
    messages = [
        Odometry(t, "odom", float(a), float(b), float(np.arctan2(np.sin(c), np.cos(c))))
        for t, a, b, c in zip(TIMES, x, y, theta, strict=True)
    ]
    read = read_wheels(recording(tmp_path, messages), "differential", axle=0.5)
    rates = np.diff(read.readings, axis=0) / 0.1
    assert np.allclose(rates, [speed - turn * 0.25, speed + turn * 0.25])
    assert read.joints == ()
    with pytest.raises(UserError, match="no wheels in it to calibrate a tricycle"):
        read_wheels(open_recording(tmp_path / "wheels.csv"), "tricycle")


def test_what_is_not_there_is_told(tmp_path: Path) -> None:
    opened = recording(tmp_path, [joints(t, ("left", "right"), t, t) for t in TIMES])
    with pytest.raises(UserError, match="no wheels called /wheels: there is joint_states"):
        read_wheels(opened, "differential", stream="/wheels")
    few = recording(tmp_path, [joints(t, ("left", "right"), t, t) for t in TIMES[:2]])
    with pytest.raises(UserError, match="too few"):
        read_wheels(few, "differential")


@pytest.mark.parametrize("modulus", [8192.0, 2.0**32])
def test_counters_overflow_both_ways(modulus: float) -> None:
    counter, steps = Counter(modulus), [modulus / 5, modulus / 3, -modulus / 2.5, 7.0, -modulus / 3, modulus / 2.2]
    sums = np.cumsum([3.0, *steps])
    assert [counter.read(float(s % modulus)) for s in sums] == pytest.approx(sums.tolist())


def test_a_counter_passes_over_what_is_no_number() -> None:
    counter = Counter(100.0)
    assert [counter.read(x) for x in (90.0, 5.0)] == [90.0, 105.0]
    assert np.isnan(counter.read(np.nan))
    assert counter.read(20.0) == 120.0
