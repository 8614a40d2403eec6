"""`groma map --vehicle`: maps whose odometry comes from the wheels of a calibrated vehicle."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

import groma.cli
from groma.evaluation.relations import RelationErrors, evaluate_relations
from groma.io.recording import open_recording, write_recording
from groma.io.trajectory import Trajectory
from groma.io.vehicle_file import write_vehicle
from groma.mapping.mapper import map_drive
from groma.mapping.result import MapResult
from groma.nouns.messages import JointState, Message
from groma.nouns.vehicle import Vehicle
from groma.recordings.drive import open_vehicle_drive
from groma.simulation.scenes import true_relations
from groma.simulation.vehicle import (
    CalibrationDrive,
    Continuous,
    Differential,
    Tricycle,
    calibration_scenario,
    simulate_calibration,
    true_vehicle,
)

Change = Callable[[Iterable[Message]], Iterable[Message]]
SECONDS = 25.0


def driven(drivetrain: Tricycle | Differential, delay: float = 0.0, seed: int = 3) -> CalibrationDrive:
    plain = calibration_scenario(drivetrain, seed)
    return simulate_calibration(msgspec.structs.replace(plain, program=Continuous(SECONDS, 0.7), delay=delay))


def mapped(path: Path, messages: Iterable[Message], vehicle: Vehicle) -> MapResult:
    write_recording(path, messages)
    return map_drive(open_vehicle_drive(open_recording(path), vehicle), {"resolution": 0.2})


def errors(drive: CalibrationDrive, result: MapResult) -> RelationErrors:
    truth = true_relations(drive.scan_stamps, drive.scan_truth)
    return evaluate_relations(truth, Trajectory(result.trajectory_stamps, result.trajectory))


def wrapped(messages: Iterable[Message]) -> Iterator[Message]:
    """Counters that wrap at half a turn; a steering angle does not change by it."""
    for message in messages:
        if isinstance(message, JointState):
            yield replace(message, positions=np.arctan2(np.sin(message.positions), np.cos(message.positions)))
        else:
            yield message


def separate(messages: Iterable[Message]) -> Iterator[Message]:
    """One message a joint."""
    for message in messages:
        if isinstance(message, JointState):
            for k, name in enumerate(message.names):
                one = slice(k, k + 1)
                yield replace(
                    message, names=(name,), positions=message.positions[one], velocities=message.velocities[one]
                )
        else:
            yield message


@pytest.mark.parametrize(
    ("drivetrain", "delay"), [(Tricycle(), 0.0), (Tricycle(), -0.1), (Differential(), 0.03), (Differential(), 0.2)]
)
def test_the_wheels_lead_to_the_truth(tmp_path: Path, drivetrain: Tricycle | Differential, delay: float) -> None:
    """2 mm in the mean: what wheels that were read ahead of the scans gave too."""
    drive = driven(drivetrain, delay)
    result = mapped(tmp_path / "drive.mcap", drive, true_vehicle(drive.scenario))
    found = errors(drive, result)
    assert found.translation.mean() < 0.002
    assert found.translation.max() < 0.006
    assert result.verdict == "consistent"
    assert result.counts["wheels_read"] == len(drive.wheel_stamps)
    assert abs(result.counts["laser_offset_x_m"]) < 0.01


@pytest.mark.parametrize("drivetrain", [Tricycle(), Differential()])
def test_wrapped_counters_and_joints_in_messages_of_their_own_give_the_same_map(
    tmp_path: Path, drivetrain: Tricycle | Differential
) -> None:
    drive = driven(drivetrain, 0.03)
    vehicle = true_vehicle(drive.scenario)
    plain = mapped(tmp_path / "plain.mcap", drive, vehicle)
    for name, change in {"wrapped": wrapped, "separate": separate}.items():
        other = mapped(tmp_path / f"{name}.mcap", change(drive), vehicle)
        assert np.array_equal(other.graph.stamps, plain.graph.stamps), name
        assert np.abs(other.trajectory - plain.trajectory).max() < 1e-6, name
        assert ("wheels-unrolled" in {f.code for f in other.findings}) == (name == "wrapped")


def test_what_was_read_later_changes_no_earlier_pose(tmp_path: Path) -> None:
    """Nothing is looked up ahead: a drive is tracked alike whatever follows, but for what is learned of the laser."""
    drive = driven(Differential())
    vehicle, half = true_vehicle(drive.scenario), float(drive.scan_stamps[len(drive.scan_stamps) // 2])
    messages = list(drive)
    whole = mapped(tmp_path / "whole.mcap", messages, vehicle)
    part = mapped(tmp_path / "part.mcap", (m for m in messages if m.stamp <= half), vehicle)
    until = half - 1.0
    same = np.sum(part.trajectory_stamps < until)
    assert same > 50
    assert np.abs(part.tracked[:same] - whole.tracked[:same]).max() < 1e-5


def test_wheels_in_another_unit_and_odometry_beside_a_vehicle_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = driven(Differential())
    vehicle = true_vehicle(drive.scenario)
    file, told = tmp_path / "drive.mcap", tmp_path / "vehicle.toml"
    write_recording(file, (m for m in drive if m.stamp < drive.scan_stamps[20]))
    write_vehicle(told, replace(vehicle, unit="tick"))
    line = ["map", str(file), "--vehicle", str(told), "-o", str(tmp_path / "out")]
    assert groma.cli.run(line) == 2
    assert "read in rad, those of the vehicle in tick" in capsys.readouterr().err
    assert groma.cli.run([*line, "--odometry", "/odom"]) == 2
    assert "contradict" in capsys.readouterr().err


@pytest.mark.shared
def test_the_cases_of_wheels_give_the_map_of_plain_ones(shared: Path, tmp_path: Path) -> None:
    joints = ("left_wheel_joint", "right_wheel_joint")
    known = {"left_radius": 0.1, "right_radius": 0.1, "axle": 0.5, "laser_x": 0.2, "laser_y": 0.05, "laser_yaw": 0.1}
    vehicle = Vehicle("differential", {**known, "delay": 0.0}, joints=joints)
    cases = {name: _unpacked(shared / "cases" / name, tmp_path) for name in ("joints_wrapped", "joints_separate")}
    plain = mapped(tmp_path / "plain.mcap", _unrolled(open_recording(cases["joints_wrapped"]).messages()), vehicle)
    for path in cases.values():
        other = map_drive(open_vehicle_drive(open_recording(path), vehicle), {"resolution": 0.2})
        truth = true_relations(plain.trajectory_stamps, plain.trajectory)
        found = evaluate_relations(truth, Trajectory(other.trajectory_stamps, other.trajectory))
        assert found.translation.max() < 1e-3, path.name
        assert found.rotation.max() < 0.02, path.name  # degrees


def _unpacked(case: Path, folder: Path) -> Path:
    (packed,) = case.glob("*.gz")
    path = folder / packed.stem
    path.write_bytes(gzip.decompress(packed.read_bytes()))
    return path


def _unrolled(messages: Iterable[Message]) -> Iterator[Message]:
    last = None
    for message in messages:
        if isinstance(message, JointState):
            rows = message.positions if last is None else np.unwrap(np.vstack([last, message.positions]), axis=0)[1]
            last = rows
            yield replace(message, positions=rows)
        else:
            yield message
