"""Calibrate a vehicle from a recording: which of its messages go into the pipeline of the core, and what comes out.

Reading of the wheels, segments, motions, estimate, findings: crate ``pipeline`` (docs/theory/vehicle_calibration.md).
Here a recording is opened to it: which stream has the wheels and which tells how the sensor moved.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from groma import _core
from groma.errors import EstimationError, UserError
from groma.io.recording import Recording
from groma.io.streams import Kind
from groma.nouns.findings import Finding, of_core
from groma.nouns.messages import JointState, LaserScan, Odometry
from groma.nouns.vehicle import PARAMETERS, Model, Vehicle
from groma.recordings.drive_choice import choose_scans
from groma.recordings.wheels import WheelChoice, choose_wheels, is_of_sensor, steers
from groma.vehicle.calibration import Free, VehicleCalibration, Verdict, driving_factor, to_calibration
from groma.vehicle.data import VehicleData, to_data

CONFIDENCE = 0.95
"""Of the half-widths that are compared with tolerances."""
Progress = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class Request:
    """The settings of a calibration."""

    model: Model | Literal["auto"] = "auto"
    wheelbase: float | None = None
    """Of a tricycle [m]; estimated when None."""
    free: tuple[Free, ...] = ()
    wheels: str | None = None
    joints: tuple[str, ...] = ()
    axle: float = 1.0
    """Wheel separation by which odometry was made, where it represents wheels [m]."""
    scans: str | None = None
    poses: str | None = None
    window: float | None = None


@dataclass(frozen=True, slots=True)
class CalibratedVehicle:
    """A calibration and what it was made of."""

    request: Request
    data: VehicleData
    found: VehicleCalibration
    core: _core.CalibrationOutcome
    """The same as the core has it."""
    tolerances: Mapping[str, float]
    """Largest half-widths wanted, by name, in SI units."""
    verdict: Verdict
    findings: tuple[Finding, ...]
    """What was noticed about the recording and the estimate."""

    @property
    def half_widths(self) -> dict[str, float]:
        """Half-widths of the intervals by name; infinite for undetermined parameters."""
        return dict(zip(self.found.names, self.found.half_widths(CONFIDENCE).tolist(), strict=True))

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle, for files and for other commands."""
        return to_vehicle(self.found, self.data)


def calibrate_vehicle(
    recording: Recording, request: Request, progress: Progress | None = None, token: _core.Token | None = None
) -> CalibratedVehicle:
    """Read a recording and estimate its vehicle.

    Parameters
    ----------
    recording
        An open recording.
    request
        What is required.
    progress
        Called with the number of scans read.
    token
        Cancels the estimate.

    Raises
    ------
    UserError
        When the recording has no wheels or nothing that tells how the sensor moved, or the request does not fit them.
    EstimationError
        When too few motions are left.
    KeyboardInterrupt
        When the token was cancelled.
    """
    model = _drive(recording, request)
    choice = choose_wheels(recording, model, stream=request.wheels, joints=request.joints, axle=request.axle)
    chosen = list(choice.findings)
    sensor, of_scans = _sensor(recording, request, chosen)
    try:
        machine = _core.CalibrateVehicle(_settings(request, model, choice, of_scans), choice.axle)
        _feed(machine, recording, choice, sensor, of_scans, progress)
        outcome = machine.finish(token)
    except ValueError as error:
        raise UserError(f"{recording.path}: {error}") from error
    except RuntimeError as error:
        raise EstimationError(f"{recording.path}: {error}") from error
    source = f"scans of {sensor}" if of_scans else f"poses of the sensor from {sensor}"
    data = to_data(outcome.data(), choice, source, model != "differential")
    found = to_calibration(outcome.estimate())
    findings = (*chosen, *of_core(outcome.findings()))
    return CalibratedVehicle(request, data, found, outcome, {}, found.verdict({}), findings)


def to_vehicle(found: VehicleCalibration, data: VehicleData) -> Vehicle:
    """Return the vehicle of an estimate, for files and for other commands; without a covariance where it is open.

    Raises
    ------
    EstimationError
        When an estimated number is none that a vehicle can have.
    """
    values = {"delay": 0.0, "steering_gain": 1.0, **found.parameters}
    parameters = {name: values[name] for name in PARAMETERS[found.model]}
    known = ((), np.zeros((0, 0))) if found.weak else (found.names, found.covariance)
    try:
        return Vehicle(found.model, parameters, *known, data.wheels.unit, data.wheels.joints)
    except ValueError as error:
        raise EstimationError(f"the drive allows no estimate: {error}") from error


def judged(result: CalibratedVehicle, tolerances: Mapping[str, float]) -> CalibratedVehicle:
    """Return a result with the verdict on tolerances (SI units, by name of an estimated parameter)."""
    verdict = result.found.verdict(tolerances, CONFIDENCE)
    missed = of_core(result.core.missed(dict(tolerances)))
    findings = (*(f for f in result.findings if f.code != "tolerance-missed"), *missed)
    return CalibratedVehicle(result.request, result.data, result.found, result.core, tolerances, verdict, findings)


def more_driving(result: CalibratedVehicle) -> float:
    """Return how many times the driving so far it takes to meet the tolerances; infinite where something stays open."""
    factors = [driving_factor(result.half_widths[name], wanted) for name, wanted in result.tolerances.items()]
    return max(factors, default=1.0)


def _drive(recording: Recording, request: Request) -> Model:
    """Return a model with the wheels of the one requested: a tricycle wherever a joint steers."""
    if request.model != "auto":
        return request.model
    return "tricycle" if steers(recording, request.wheels, request.joints) else "differential"


def _sensor(recording: Recording, request: Request, findings: list[Finding]) -> tuple[str, bool]:
    """Return the stream that tells how the sensor moved, and whether it has scans."""
    if request.poses is not None:
        there = [s.name for s in recording.streams if s.kind is Kind.ODOMETRY]
        if request.poses not in there:
            raise UserError(
                f"{recording.path}: no poses called {request.poses}: there are {', '.join(there) or 'none'}"
            )
        return request.poses, False
    if request.scans is not None or any(s.kind is Kind.SCAN for s in recording.streams):
        return choose_scans(recording, request.scans, findings), True
    for message in recording.messages({s.name for s in recording.streams if s.kind is Kind.ODOMETRY}):
        if isinstance(message, Odometry) and is_of_sensor(message.child_frame):
            return message.stream, False
    raise UserError(f"{recording.path}: neither laser scans in it nor poses of the sensor (--poses names their stream)")


def _settings(request: Request, model: Model, choice: WheelChoice, of_scans: bool) -> str:
    steered = model != "differential"
    free = [name for name in request.free if steered or name != "wheelbase"]
    settings = {
        "model": None if request.model == "auto" else request.model,
        "steered": steered,
        "wheelbase": request.wheelbase,
        "free": free,
        "window": request.window,
        "source": "scans" if of_scans else "poses",
        "lateness": choice.lateness,
    }
    return json.dumps(settings)


def _feed(
    machine: _core.CalibrateVehicle,
    recording: Recording,
    choice: WheelChoice,
    sensor: str,
    of_scans: bool,
    progress: Progress | None,
) -> None:
    """Push the messages of a recording in the order in which it has them."""
    count = 0
    for message in recording.messages({choice.stream, sensor}):
        if isinstance(message, JointState) and message.stream == choice.stream:
            machine.push_wheels(message.stamp, choice.positions(message))
        elif isinstance(message, LaserScan) and of_scans and message.stream == sensor:
            g = message.geometry
            beams = (g.angle_min, g.angle_increment, g.time_increment, g.range_min, g.range_max)
            machine.push_scan(message.stamp, np.ascontiguousarray(message.ranges), beams)
            count += 1
            if progress:
                progress(count)
        elif isinstance(message, Odometry) and message.stream in (choice.stream, sensor):
            pose = (message.stamp, message.x, message.y, message.theta)
            if choice.kind is Kind.ODOMETRY and message.stream == choice.stream:
                machine.push_odometry(*pose)
            if not of_scans and message.stream == sensor:
                machine.push_pose(*pose)
