"""Simulated recordings for the calibration of a vehicle, with the parameters that are to be found.

The wheels are commanded and the path results, so that the parameters are exactly those of the model
of :mod:`groma.nouns.vehicle`; slip, steering error, range noise and the steps of the encoders are what a recording has
beside it. All values have their defaults in the Rust core. The same scenario gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import msgspec
import numpy as np

from groma import _core
from groma.errors import UserError
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry, JointState, LaserScan, Message
from groma.nouns.vehicle import Model, Vehicle
from groma.simulation.scenes import Scanner


class Tricycle(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="tricycle"):
    """One steered, driven wheel in front of a fixed axle [m, rad], per radian of the encoders."""

    drive_scale: float = 0.125
    wheelbase: float = 1.5
    steering_gain: float = 1.0
    steering_offset_forward: float = float(np.radians(-0.7593))
    steering_offset_backward: float = float(np.radians(-0.7593))


class Differential(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="differential"):
    """Two driven wheels on one axle [m], per radian of the encoders."""

    left_radius: float = 0.1003
    right_radius: float = 0.0996
    axle: float = 0.552


class WheelNoise(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the wheels do beside what they are told."""

    slip: float
    """Standard deviation of a wheel's travel after one metre [m]."""
    steering: float
    """Standard deviation of the steering angle [rad]."""
    memory: float
    """For how long a steering error is remembered [s]."""
    counter_step: float
    """Step of the counters of the driven wheels [rad]; 0 for none."""
    steering_step: float
    """Step of the steering encoder [rad]; 0 for none."""


class Arcs(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="arcs"):
    """Arcs from standstill to standstill: every angle left and right, forward and backward."""

    angles: int
    from_: float = msgspec.field(name="from")
    """Smallest angle of the wheel [rad]; of a differential drive, its tangent is axle / radius."""
    to: float
    """Largest angle [rad]."""
    turn: float
    """Turn of the vehicle on an arc [rad]."""
    pause: float
    """Standstill between two arcs [s]."""


class Continuous(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="continuous"):
    """Ordinary driving: speed and angle change every few seconds."""

    duration: float
    """[s]."""
    to: float
    """Largest angle [rad]."""


class Course(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What `groma simulate vehicle` drives, in the words of its user."""

    model: Model = "tricycle"
    drive: Literal["arcs", "continuous"] = "arcs"
    arcs: int = 16
    """Number of arcs, a multiple of 4."""
    duration: float = 60.0
    """Of continuous driving [s]."""
    delay: float = 0.0
    """By how much the stamps of the wheels are later than those of the scans [s]."""
    seed: int = 1
    """Draws the hall and all noise."""


class CalibrationScenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that a recording for calibration depends on."""

    seed: int
    start: float
    """Stamp of the start [s]."""
    drivetrain: Tricycle | Differential
    noise: WheelNoise
    program: Arcs | Continuous
    speed: float
    """Of the driven wheel, or of the base of a differential drive [m/s]."""
    scanner: Scanner
    """Its mount is part of the truth."""
    delay: float
    """Stamps of the wheels minus true time [s]."""
    wheel_period: float
    """Time between two readings of the wheels [s]."""


@dataclass(frozen=True, slots=True)
class CalibrationDrive:
    """A recording for calibration and its truth; poses are ``T_world_base`` as x [m], y [m], theta [rad]."""

    scenario: CalibrationScenario
    scan_stamps: Array
    """(S,) [s]."""
    scan_truth: Array
    """(S, 3) true poses at these stamps."""
    ranges: Array
    """(S, B) [m]; ``+inf`` no return, NaN too close."""
    wheel_stamps: Array
    """(K,) [s]."""
    readings: Array
    """(K, 2) angle of the driven wheel and steering angle, or angles of both wheels [rad]."""
    truth: Array
    """(K, 3) true poses at the true times of the readings."""

    def __iter__(self) -> Iterator[Message]:
        """Yield all messages in order of their stamps."""
        geometry = beam_geometry(self.scenario)
        names = joint_names(self.scenario.drivetrain)
        empty = np.empty(0)
        scan = 0
        for k, stamp in enumerate(self.wheel_stamps.tolist()):
            while scan < len(self.scan_stamps) and self.scan_stamps[scan] <= stamp:
                yield LaserScan(float(self.scan_stamps[scan]), "scan", "laser", geometry, self.ranges[scan], empty)
                scan += 1
            yield JointState(stamp, "joint_states", names, self.readings[k], np.full(2, np.nan))
        for rest in range(scan, len(self.scan_stamps)):
            yield LaserScan(float(self.scan_stamps[rest]), "scan", "laser", geometry, self.ranges[rest], empty)


def calibration_scenario(drivetrain: Tricycle | Differential, seed: int = 1) -> CalibrationScenario:
    """Return the scenario of a vehicle on 16 arcs in a hall."""
    text = _core.calibration_scenario(msgspec.json.encode(drivetrain).decode(), seed)
    return msgspec.json.decode(text, type=CalibrationScenario)


def simulate_calibration(scenario: CalibrationScenario, token: _core.Token | None = None) -> CalibrationDrive:
    """Drive a scenario, until the token is cancelled.

    Raises
    ------
    UserError
        When a setting makes no sense, or the vehicle would leave the floor.
    """
    try:
        core = _core.simulate_calibration(msgspec.json.encode(scenario).decode(), token)
    except ValueError as error:
        raise UserError(f"scenario: {error}") from error
    return CalibrationDrive(
        scenario, core.scan_stamps, core.scan_poses, core.ranges, core.wheel_stamps, core.readings, core.truth
    )


def joint_names(drivetrain: Tricycle | Differential) -> tuple[str, str]:
    """Return the names of the joints."""
    if isinstance(drivetrain, Tricycle):
        return ("traction_joint", "steering_joint")
    return ("left_wheel_joint", "right_wheel_joint")


def beam_geometry(scenario: CalibrationScenario) -> BeamGeometry:
    """Return the beam geometry of the scans."""
    laser = scenario.scanner
    return BeamGeometry(laser.angle_min, laser.angle_increment, laser.time_increment, laser.range_min, laser.range_max)


def true_vehicle(scenario: CalibrationScenario) -> Vehicle:
    """Return the vehicle that calibration has to find."""
    drive = scenario.drivetrain
    x, y, yaw = scenario.scanner.mount
    common = {"laser_x": x, "laser_y": y, "laser_yaw": yaw, "delay": scenario.delay}
    joints = joint_names(drive)
    if isinstance(drive, Differential):
        return Vehicle("differential", {**msgspec.structs.asdict(drive), **common}, joints=joints)
    own = msgspec.structs.asdict(drive)
    model: Model = "tricycle-asymmetric"
    if drive.steering_offset_forward == drive.steering_offset_backward:
        model = "tricycle"
        own["steering_offset"] = own.pop("steering_offset_forward")
        del own["steering_offset_backward"]
    return Vehicle(model, {**own, **common}, joints=joints)
