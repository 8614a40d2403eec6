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

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Literal

import numpy as np

from groma import _core
from groma.nouns.arrays import Array
from groma.nouns.findings import Finding, of_core

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
class WheelNoise:
    """What wheels do beside what they read."""

    slip: float
    """Standard deviation of the travel of a driven wheel after one metre [m]; it grows with the root of the path."""
    steering: float
    """Standard deviation of the steering angle that the encoder does not see [rad]."""
    memory: float
    """For how long a steering error lasts before it is another one [s]."""


@dataclass(frozen=True, slots=True)
class Scanner:
    """A scanner on a vehicle."""

    name: str
    """Its frame or topic; may be empty where there is one."""
    x: float
    y: float
    """Where it sits [m]."""
    yaw: float
    """Which way it looks [rad]."""
    range_offset: float = 0.0
    """What its ranges are too long [m]."""


def usual_noise() -> WheelNoise:
    """Return the noise of wheels of which nothing else is known."""
    return WheelNoise(**json.loads(_core.wheel_noise_defaults()))


@dataclass(frozen=True, slots=True)
class Vehicle:
    """Parameters of a vehicle and their joint covariance.

    Raises
    ------
    ValueError
        When a number is not finite or out of range, by name, or parts do not belong together.
    """

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

    noise: WheelNoise = field(default_factory=usual_noise)
    """What its wheels do beside what they read."""
    scanner: str = ""
    """Name of the scanner at ``laser_x``, ``laser_y``, ``laser_yaw``."""
    range_offset: float = 0.0
    """What its ranges are too long [m]."""
    others: tuple[Scanner, ...] = ()
    """Further scanners."""

    def __post_init__(self) -> None:
        wanted = PARAMETERS[self.model]
        if set(self.parameters) != set(wanted):
            raise ValueError(f"a {self.model} has the parameters {', '.join(wanted)}")
        if not set(self.names) <= set(wanted) or self.covariance.shape != (len(self.names), len(self.names)):
            raise ValueError("the covariance is not that of the named parameters")
        named = {**self.parameters, "range_offset": self.range_offset, **asdict(self.noise)}
        for name, value in named.items():
            if not math.isfinite(value):
                raise ValueError(f"{name} = {value}: must be a finite number")
        if not np.isfinite(self.covariance).all():
            raise ValueError("covariance: must be finite")
        _core.check_vehicle(self.to_json())

    def tree(self) -> dict[str, object]:
        """Return the vehicle as ``vehicle.toml`` holds it."""
        drive = [name for name in PARAMETERS[self.model] if name not in COMMON]
        first = Scanner(self.scanner, *self.laser, self.range_offset)
        tree: dict[str, object] = {
            "version": 2,
            "unit": self.unit,
            "joints": list(self.joints),
            "delay": float(self.parameters["delay"]),
            "drive": {"model": self.model, **{name: float(self.parameters[name]) for name in drive}},
            "noise": asdict(self.noise),
            "scanners": [asdict(scanner) for scanner in (first, *self.others)],
        }
        if self.names:
            tree["covariance"] = {"names": list(self.names), "matrix": self.covariance.tolist()}
        return tree

    def to_json(self) -> str:
        """Return the vehicle as the core takes it."""
        return json.dumps(self.tree())

    @property
    def laser(self) -> tuple[float, float, float]:
        """``T_base_laser`` as x [m], y [m], yaw [rad]."""
        return self.parameters["laser_x"], self.parameters["laser_y"], self.parameters["laser_yaw"]

    def handedness(self) -> tuple[Finding, ...]:
        """Return what the signs of the parameters say about how the wheels are wired."""
        return of_core(_core.vehicle_handedness(self.to_json()))

    def sigma(self, name: str) -> float:
        """Return the standard deviation of a parameter; 0 when it was given."""
        if name not in self.names:
            return 0.0
        k = self.names.index(name)
        return float(np.sqrt(self.covariance[k, k]))
