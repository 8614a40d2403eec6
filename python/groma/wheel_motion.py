"""The motions of the base between readings of the wheels, for a calibrated vehicle: arrays over a whole drive.

A step counts what the counters gained; the steering is the mean of its ends, as calibration takes it. Noise and
derivatives are those of :class:`groma.wheels.Wheels`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma.vehicle import Vehicle
from groma.wheels import Wheels

Array = NDArray[np.float64]

DRIVE = 5
"""Parameters of a drive that a localizer knows of."""
_TRICYCLE = {
    "drive_scale": (0,),
    "wheelbase": (1,),
    "steering_gain": (2,),
    "steering_offset": (3, 4),
    "steering_offset_forward": (3,),
    "steering_offset_backward": (4,),
}
_DIFFERENTIAL = {"left_radius": (0,), "right_radius": (1,), "axle": (2,)}
_MOUNT = {"laser_x": (DRIVE,), "laser_y": (DRIVE + 1,), "laser_yaw": (DRIVE + 2,)}
"""Places of the parameters of a vehicle among those of a localizer: five of the drive, three of the mount."""


@dataclass(frozen=True, slots=True)
class Motions:
    """K motions of the base, one after the other."""

    start: float
    """When the first begins [s]."""
    stamps: Array
    """(K,) when they end [s], rising."""
    motions: Array
    """(K, 3) ``T_before_after`` as x, y [m], theta [rad]."""
    covariances: Array
    """(K, 3, 3) of their body-frame perturbations."""
    by_drive: Array
    """(K, 3, 5) the perturbation by the parameters of the drive."""


def wheel_motions(vehicle: Vehicle, stamps: Array, readings: Array) -> Motions:
    """Return the motions between readings of the wheels.

    Parameters
    ----------
    vehicle
        Its parameters.
    stamps
        (K,) by the clock of the wheels, strictly rising [s].
    readings
        (K, 2) counts of the driven wheel, summed, and steering angle [rad]; or counts of left and right wheel.

    Raises
    ------
    ValueError
        When there are fewer than two readings.
    """
    if len(stamps) < 2:
        raise ValueError("a drive needs at least two readings of the wheels")
    inputs = np.diff(readings, axis=0)
    if vehicle.model != "differential":
        inputs[:, 1] = (readings[:-1, 1] + readings[1:, 1]) / 2
    wheels = _wheels(vehicle)
    motions, covariances, by_drive = zip(
        *(wheels.motion(a, b, dt) for (a, b), dt in zip(inputs.tolist(), np.diff(stamps).tolist(), strict=True)),
        strict=True,
    )
    clock = stamps - vehicle.parameters["delay"]
    return Motions(float(clock[0]), clock[1:], np.array(motions), np.array(covariances), np.array(by_drive))


def calibration_covariance(vehicle: Vehicle) -> Array:
    """Return the (8, 8) covariance of drive and mount: five parameters of the drive, then the mount's perturbation."""
    places = (_DIFFERENTIAL if vehicle.model == "differential" else _TRICYCLE) | _MOUNT
    names = [name for name in vehicle.names if name in places]
    spread = np.zeros((DRIVE + 3, len(names)))
    for column, name in enumerate(names):
        spread[list(places[name]), column] = 1.0
    kept = [vehicle.names.index(name) for name in names]
    c, s = np.cos(vehicle.parameters["laser_yaw"]), np.sin(vehicle.parameters["laser_yaw"])
    turn = np.eye(DRIVE + 3)
    turn[DRIVE : DRIVE + 2, DRIVE : DRIVE + 2] = [[c, s], [-s, c]]
    spread = turn @ spread
    covariance: Array = spread @ vehicle.covariance[np.ix_(kept, kept)] @ spread.T
    return covariance


def _wheels(vehicle: Vehicle) -> Wheels:
    p = vehicle.parameters
    if vehicle.model == "differential":
        return Wheels("differential", [p["left_radius"], p["right_radius"], p["axle"]], vehicle.noise)
    offset = p.get("steering_offset", 0.0)
    forward, backward = (p.get(f"steering_offset_{way}", offset) for way in ("forward", "backward"))
    return Wheels("tricycle", [p["drive_scale"], p["wheelbase"], p["steering_gain"], forward, backward], vehicle.noise)
