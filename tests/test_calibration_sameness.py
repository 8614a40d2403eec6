"""`groma calibrate vehicle` and the library say the same of the same messages, for every vehicle and form of wheels.

The command reads a recording and leaves a vehicle.toml. The library is fed here as a user would: message by message,
joints named by hand, asked in between. Values agree to 1e-9, and covariances to 1e-9 of the sigmas; so does the
estimator alone, given readings and motions.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import pytest

import groma.cli
from groma import _core
from groma.io.recording import open_recording, write_recording
from groma.io.vehicle_file import read_vehicle
from groma.nouns.messages import JointState, LaserScan, Message, Odometry
from groma.nouns.vehicle import Model, Vehicle
from groma.simulation.vehicle import (
    Arcs,
    CalibrationDrive,
    Continuous,
    Differential,
    Tricycle,
    calibration_scenario,
    simulate_calibration,
    true_vehicle,
)
from groma.vehicle.calibration import OdometryLog, SensorMotions, VehicleCalibration, calibrate, to_calibration

AGREE = 1e-9
VEHICLES: dict[Model, Tricycle | Differential] = {
    "tricycle": Tricycle(),
    "tricycle-asymmetric": Tricycle(steering_offset_backward=Tricycle().steering_offset_forward - math.radians(1.0)),
    "differential": Differential(),
}


@dataclass(frozen=True)
class Case:
    """The settings of the command, and the same in words of the library."""

    options: str
    wheels: str
    """Stream of the wheels."""
    joints: tuple[str, ...] = ()
    """In the order of the library: traction and steering, or left and right. None: wheels are made from odometry."""
    poses: str = ""
    """Stream of poses of the sensor, where there are no scans."""
    axle: float = 1.0
    settings: tuple[tuple[str, object], ...] = ()

    @property
    def asked(self) -> dict[str, object]:
        return {"source": "poses" if self.poses else "scans", **dict(self.settings)}


def command(recording: Path, case: Case, output: Path) -> Vehicle:
    """What the command writes, whatever its verdict."""
    assert groma.cli.run(["calibrate", "vehicle", str(recording), *case.options.split(), "-o", str(output)]) in (0, 1)
    return read_vehicle(output / "vehicle.toml")


def push(machine: _core.CalibrateVehicle, message: Message, case: Case) -> None:
    stream = message.stream.removeprefix("/")  # ROS bags write one
    if isinstance(message, JointState) and stream == case.wheels:
        read = dict(zip(message.names, message.positions.tolist(), strict=True))
        machine.push_wheels(message.stamp, [(k, read[name]) for k, name in enumerate(case.joints) if name in read])
    elif isinstance(message, LaserScan) and not case.poses:
        g = message.geometry
        beams = (g.angle_min, g.angle_increment, g.time_increment, g.range_min, g.range_max)
        machine.push_scan(message.stamp, np.ascontiguousarray(message.ranges), beams)
    elif isinstance(message, Odometry) and stream in (case.wheels, case.poses):
        take = machine.push_odometry if stream == case.wheels else machine.push_pose
        take(message.stamp, message.x, message.y, message.theta)


def library(
    messages: Iterable[Message], case: Case, asked_between: bool
) -> tuple[VehicleCalibration, VehicleCalibration]:
    """The pipeline fed message by message, and the estimator alone on what the pipeline hands over."""
    machine = _core.CalibrateVehicle(json.dumps(case.asked), case.axle)
    every = list(messages)
    for k, message in enumerate(every):
        push(machine, message, case)
        if asked_between and k == len(every) * 3 // 4:
            machine.snapshot()
    outcome = machine.finish()
    fed, data = to_calibration(outcome.estimate()), outcome.data()
    motions = SensorMotions(data.start, data.end, data.motion, data.covariance, data.coupling)
    steered = fed.model != "differential"
    readings = data.readings
    log = OdometryLog(data.time, readings[:, : 1 if steered else 2], readings[:, 1] if steered else None)
    asked = {name: case.asked[name] for name in ("wheelbase", "free") if name in case.asked}
    return fed, calibrate(case.asked.get("model", "auto"), log, motions, **asked)  # type: ignore[arg-type]


def same(vehicle: Vehicle, found: VehicleCalibration) -> None:
    assert vehicle.model == found.model
    assert vehicle.names == found.names
    values = np.array([vehicle.parameters[name] for name in vehicle.names])
    np.testing.assert_allclose(values, found.values, rtol=AGREE, atol=1e-12)
    apart = (np.asarray(vehicle.covariance) - found.covariance) / np.outer(found.sigmas, found.sigmas)
    assert np.abs(apart).max() < AGREE


def holds(recording: Path, case: Case, output: Path, asked_between: bool = False) -> Vehicle:
    written = command(recording, case, output)
    fed, alone = library(open_recording(recording).messages(), case, asked_between)
    same(written, fed)
    same(written, alone)
    return written


@functools.cache
def simulated(model: Model, seconds: float | None = None) -> CalibrationDrive:
    """Eight arcs, or so many seconds of driving on."""
    scenario = calibration_scenario(VEHICLES[model], 1)
    assert isinstance(scenario.program, Arcs)
    arcs = msgspec.structs.replace(scenario.program, angles=2)
    program = arcs if seconds is None else Continuous(seconds, 0.87)
    scanner = msgspec.structs.replace(scenario.scanner, period=0.4)
    return simulate_calibration(msgspec.structs.replace(scenario, program=program, scanner=scanner))


def joint_states(drive: CalibrationDrive, path: Path) -> None:
    write_recording(path, drive)


def joints_apart(drive: CalibrationDrive, path: Path) -> None:
    """A message for each joint, as some drivers write them."""

    def split() -> Iterator[Message]:
        for m in drive:
            if isinstance(m, JointState):
                for k in (1, 0):
                    yield JointState(
                        m.stamp, m.stream, m.names[k : k + 1], m.positions[k : k + 1], m.velocities[k : k + 1]
                    )
            else:
                yield m

    write_recording(path, split())


def ticks(drive: CalibrationDrive, path: Path) -> None:
    """Counts of 16 bits that overflow; of the driven wheels, nobody knows how many make a turn."""
    write_recording(path, (m for m in drive if isinstance(m, LaserScan)))
    scans = [line for line in path.read_text().splitlines() if line.startswith(("GEOMETRY", "SCAN"))]
    names = next(m.names for m in drive if isinstance(m, JointState))
    steered = not isinstance(drive.scenario.drivetrain, Differential)
    turn = ("nan", "16384") if steered else ("nan", "nan")
    lines = [f"ENCODER,joint_states,{name},{per},65536" for name, per in zip(names, turn, strict=True)]
    counts = np.round(drive.readings * 16384 / (2 * math.pi)).astype(np.int64) % 65536
    for stamp, (a, b) in zip(drive.wheel_stamps.tolist(), counts.tolist(), strict=True):
        lines.append(f"TICKS,{stamp!r},joint_states,2,{names[0]},{a},{names[1]},{b}")
    lines = [*(line for line in scans if line.startswith("GEOMETRY")), *lines]
    lines += [line for line in scans if line.startswith("SCAN")]
    stamp_at = {"GEOMETRY": -math.inf, "ENCODER": -math.inf}

    def when(line: str) -> float:
        tag, field, *_ = line.split(",")
        return stamp_at.get(tag, 0.0) or float(field)

    path.write_text("\n".join(sorted(lines, key=when)) + "\n")


def odometry(drive: CalibrationDrive, path: Path) -> None:
    """The poses that the true wheels tell, and no joints."""
    told = _core.dead_reckoning(true_vehicle(drive.scenario).to_json(), drive.readings, [])
    poses = dict(zip(drive.wheel_stamps.tolist(), told.tolist(), strict=True))
    write_recording(
        path, (Odometry(m.stamp, "odom", *poses[m.stamp]) if isinstance(m, JointState) else m for m in drive)
    )


def asked_of(drive: CalibrationDrive, options: str = "", **settings: object) -> Case:
    """The case of joints of a simulated vehicle."""
    names = next(m.names for m in drive if isinstance(m, JointState))
    steered = not isinstance(drive.scenario.drivetrain, Differential)
    told: dict[str, object] = {"steered": steered, "wheelbase": 1.5 if steered else None, **settings}
    options = options + (" --wheelbase 1.5" if steered else "")
    return Case(options, "joint_states", names, settings=tuple(told.items()))


@pytest.mark.parametrize("model", list(VEHICLES))
@pytest.mark.parametrize(("form", "suffix"), [(joint_states, "mcap"), (joints_apart, "csv"), (ticks, "csv")])
def test_arcs_however_the_wheels_are_told(
    model: Model, form: object, suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = simulated(model)
    assert callable(form)
    form(drive, tmp_path / f"drive.{suffix}")
    found = holds(tmp_path / f"drive.{suffix}", asked_of(drive), tmp_path / "out")
    capsys.readouterr()
    truth = true_vehicle(drive.scenario).parameters
    for name in ("laser_x", "laser_y", "laser_yaw"):
        assert abs(found.parameters[name] - truth[name]) < 4.5 * found.sigma(name), name
    assert found.model == model
    assert found.unit == ("tick" if form is ticks else "rad")


@pytest.mark.parametrize("model", list(VEHICLES))
def test_driving_on_with_a_delay_to_find(model: Model, tmp_path: Path) -> None:
    drive = simulated(model, 20.0)
    joint_states(drive, tmp_path / "drive.csv")
    case = asked_of(drive, f"--model {model} --free delay --window 1", model=model, free=["delay"], window=1.0)
    holds(tmp_path / "drive.csv", case, tmp_path / "out", asked_between=True)


def test_odometry_in_place_of_wheels(tmp_path: Path) -> None:
    drive = simulated("differential")
    odometry(drive, tmp_path / "drive.csv")
    found = holds(tmp_path / "drive.csv", Case("--axle 0.5", "odom", axle=0.5), tmp_path / "out")
    assert found.parameters["left_radius"] == pytest.approx(1.0, abs=0.02)


def rover() -> Case:
    options = "--free delay --window 1"
    return Case(options, "wheels", ("left_wheel", "right_wheel"), settings=(("free", ["delay"]), ("window", 1.0)))


TURTLEBOT = Case("", "joint_states", ("wheel_left_joint", "wheel_right_joint"))


@pytest.mark.shared
@pytest.mark.parametrize(
    ("file", "case"),
    [
        ("mines-rover/exp1.dat.gz", rover()),
        ("mines-rover/exp2.dat.gz", rover()),
        ("bags/fuse_turtlebot3.bag", TURTLEBOT),
        ("bags/fuse_turtlebot3.bag", Case("--wheels /odom --axle 0.287", "odom", axle=0.287)),
        (
            "calib-tricycle/dataset_first_half.txt.gz",
            Case(
                "--free gain",
                "joints",
                ("traction_wheel", "steering"),
                "tracker_pose",
                settings=(("steered", True), ("free", ["gain"])),
            ),
        ),
        ("calib-censi/lstraight_0.tuple.gz", Case("", "wheels", ("left_wheel", "right_wheel"), "laser_poses")),
    ],
    ids=["mines-1", "mines-2", "turtlebot-joints", "turtlebot-odometry", "tracked-tricycle", "khepera"],
)
def test_recordings_of_others(shared: Path, file: str, case: Case, tmp_path: Path) -> None:
    holds(shared / "data" / file, case, tmp_path / "out")
