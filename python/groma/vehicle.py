"""A vehicle as calibration leaves it: how its wheels move it, where its laser sits, and how well both are known.

The frame of the vehicle (``base_link``) lies midway between the fixed wheels, x forward. Of every reading of the wheels
``n`` is what a counter gained (signed) and ``alpha`` what the steering encoder says:

    tricycle      travel of the steered, driven wheel  d = drive_scale n
                  its angle                            delta = steering_gain alpha + steering_offset
                  base                                 v = d cos(delta),  turn = d sin(delta) / wheelbase
    tricycle-asymmetric    as above, with one offset for n > 0 and one for n < 0
    differential  base   v = (left_radius n_l + right_radius n_r) / 2
                         turn = (right_radius n_r - left_radius n_l) / axle

A counter that reads radians makes ``drive_scale`` and the radii the radii of wheels [m]; one that reads ticks makes
them metres per tick. A scan stamped t is of the wheels' time ``t + delay``. The laser's height, roll and pitch do not
show in planar motion and are not here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Model = Literal["tricycle", "tricycle-asymmetric", "differential"]
Unit = Literal["rad", "tick"]

COMMON = ("laser_x", "laser_y", "laser_yaw", "delay")
"""Parameters of every vehicle [m, m, rad, s]."""
PARAMETERS: Mapping[str, tuple[str, ...]] = {
    "tricycle": ("drive_scale", "steering_offset", "wheelbase", "steering_gain", *COMMON),
    "tricycle-asymmetric": (
        "drive_scale",
        "steering_offset_forward",
        "steering_offset_backward",
        "wheelbase",
        "steering_gain",
        *COMMON,
    ),
    "differential": ("left_radius", "right_radius", "axle", *COMMON),
}
"""Parameters of a model by name, in the order of files and tables."""
JOINTS: Mapping[str, tuple[str, ...]] = {
    "tricycle": ("traction", "steering"),
    "tricycle-asymmetric": ("traction", "steering"),
    "differential": ("left", "right"),
}
"""What the joints of a model do, in the order of their readings."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """Parameters of a vehicle and their joint covariance."""

    model: Model
    parameters: Mapping[str, float]
    """Value of every parameter of the model, by name: metres, radians, seconds, metres per unit of the counters."""
    names: tuple[str, ...] = ()
    """The estimated parameters; the others were given."""
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """(n, n) of the estimated parameters."""
    unit: Unit = "rad"
    """Unit of the counters of the driven wheels; steering readings are radians."""
    joints: tuple[str, ...] = ()
    """Names of the joints in the recording, in the order of ``JOINTS``; empty when the recording has no names."""

    def __post_init__(self) -> None:
        wanted = PARAMETERS[self.model]
        if set(self.parameters) != set(wanted):
            raise ValueError(f"a {self.model} has the parameters {', '.join(wanted)}")
        if not set(self.names) <= set(wanted) or self.covariance.shape != (len(self.names), len(self.names)):
            raise ValueError("the covariance is not that of the named parameters")

    @property
    def laser(self) -> tuple[float, float, float]:
        """``T_base_laser`` as x [m], y [m], yaw [rad]."""
        return self.parameters["laser_x"], self.parameters["laser_y"], self.parameters["laser_yaw"]

    def sigma(self, name: str) -> float:
        """Return the standard deviation of a parameter; 0 when it was given."""
        if name not in self.names:
            return 0.0
        k = self.names.index(name)
        return float(np.sqrt(self.covariance[k, k]))


def dead_reckoning(vehicle: Vehicle, readings: Array) -> Array:
    """Return the poses (n, 3) that the wheels tell, on exact arcs from one reading to the next.

    Parameters
    ----------
    vehicle
        Its ``laser`` and ``delay`` have no part in this.
    readings
        (n, 2) counter and steering angle, or both counters; steering is the mean of the two readings of a step.

    Returns
    -------
    Array
        ``T_odom_base`` as x [m], y [m], theta [rad, turns counted]; the first is zero.
    """
    way, turn = _steps(vehicle, readings)
    theta = np.concatenate([[0.0], np.cumsum(turn)])
    half = turn / 2
    chord = way * np.sinc(half / np.pi)
    along = theta[:-1] + half
    x, y = np.cumsum(chord * np.cos(along)), np.cumsum(chord * np.sin(along))
    return np.column_stack([np.concatenate([[0.0], x]), np.concatenate([[0.0], y]), theta])


def _steps(vehicle: Vehicle, readings: Array) -> tuple[Array, Array]:
    """Return the way [m] and the turn [rad] of the base (n - 1,) between readings."""
    p, step = vehicle.parameters, np.diff(readings, axis=0)
    if vehicle.model == "differential":
        left, right = p["left_radius"] * step[:, 0], p["right_radius"] * step[:, 1]
        return (left + right) / 2, (right - left) / p["axle"]
    travel = p["drive_scale"] * step[:, 0]
    if vehicle.model == "tricycle":
        offset = np.full(len(travel), p["steering_offset"])
    else:
        offset = np.where(travel < 0, p["steering_offset_backward"], p["steering_offset_forward"])
    delta = p["steering_gain"] * (readings[:-1, 1] + readings[1:, 1]) / 2 + offset
    return travel * np.cos(delta), travel * np.sin(delta) / p["wheelbase"]
