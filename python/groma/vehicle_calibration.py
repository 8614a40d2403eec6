"""Calibrate a vehicle from a recording: what is read, what is estimated, and whether that is enough.

Reading is that of :mod:`groma.vehicle_data`, estimation that of :mod:`groma.calibration`. Here both meet what the user
asked for: a model, what is free, tolerances.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from groma.calibration import Free, VehicleCalibration, Verdict, calibrate
from groma.egomotion import Progress
from groma.errors import EstimationError, UserError
from groma.io.recording import Recording
from groma.io.wheels import steers
from groma.vehicle import PARAMETERS, Model, Vehicle
from groma.vehicle_data import VehicleData, vehicle_data

CONFIDENCE = 0.95
"""Of the half-widths that are compared with tolerances."""


@dataclass(frozen=True, slots=True)
class Request:
    """What a calibration is asked for."""

    model: Model | Literal["auto"] = "auto"
    wheelbase: float | None = None
    """Of a tricycle [m]; estimated when None."""
    free: tuple[Free, ...] = ()
    wheels: str | None = None
    joints: tuple[str, ...] = ()
    axle: float = 1.0
    """Wheel separation by which odometry was made, where it stands for wheels [m]."""
    scans: str | None = None
    poses: str | None = None
    window: float | None = None


@dataclass(frozen=True, slots=True)
class CalibratedVehicle:
    """A calibration and what it was made of."""

    request: Request
    data: VehicleData
    found: VehicleCalibration
    tolerances: Mapping[str, float]
    """Largest half-widths wanted, by name, in SI units."""
    verdict: Verdict

    @property
    def half_widths(self) -> dict[str, float]:
        """Half-widths of the intervals by name; infinite for what the drive leaves open."""
        return dict(zip(self.found.names, self.found.half_widths(CONFIDENCE).tolist(), strict=True))

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle, for files and for other commands."""
        return to_vehicle(self.found, self.data)


def calibrate_vehicle(recording: Recording, request: Request, progress: Progress | None = None) -> CalibratedVehicle:
    """Read a recording and estimate its vehicle.

    Parameters
    ----------
    recording
        An open recording.
    request
        What is wanted.
    progress
        Called with the number of scans read.

    Raises
    ------
    UserError
        When the recording has no wheels or nothing that tells how the sensor moved, or the request does not fit them.
    EstimationError
        When too few motions are left.
    """
    data = vehicle_data(
        recording,
        _drive(recording, request),
        wheels=request.wheels,
        joints=request.joints,
        axle=request.axle,
        scans=request.scans,
        poses=request.poses,
        window=request.window,
        progress=progress,
    )
    free: Iterable[Free] = request.free
    if data.log.steering is None:
        free = [name for name in free if name != "wheelbase"]
    try:
        found = calibrate(request.model, data.log, data.motions, wheelbase=request.wheelbase, free=free)
    except ValueError as error:
        raise UserError(f"{recording.path}: {error}") from error
    except RuntimeError as error:
        raise EstimationError(f"{recording.path}: {error}") from error
    return CalibratedVehicle(request, data, found, {}, found.verdict({}))


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
    return CalibratedVehicle(result.request, result.data, result.found, tolerances, verdict)


def more_driving(result: CalibratedVehicle) -> float:
    """Return how many times the driving so far it takes to meet the tolerances; infinite where something stays open.

    Half-widths fall with the root of the driving, of the same kind.
    """
    ratios = [result.half_widths[name] / tolerance for name, tolerance in result.tolerances.items()]
    worst = max(ratios, default=0.0)
    return math.inf if not np.isfinite(worst) else max(1.0, worst**2)


def _drive(recording: Recording, request: Request) -> Model:
    """Return a model with the wheels of the one asked for: a tricycle wherever a joint steers."""
    if request.model != "auto":
        return request.model
    return "tricycle" if steers(recording, request.wheels, request.joints) else "differential"
