"""What a recording is made of: frozen values, SI units, radians, stamps in seconds.

Poses are ``T_parent_child``. Readers normalise to these; nothing else in groma knows a file format. None can be built
with a number that is not finite or out of its bound: the constructor raises ``groma.nouns.bounds.OutOfRangeError``,
which names the field and the value.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from groma.nouns.arrays import Array
from groma.nouns.bounds import require, require_all


@dataclass(frozen=True, slots=True)
class BeamGeometry:
    """Where the beams of a scanner point; beam ``i`` has bearing ``angle_min + i * angle_increment``."""

    angle_min: float
    angle_increment: float
    time_increment: float
    """Time between two beams; 0 when unknown."""
    range_min: float
    range_max: float
    """A reading is a hit iff it is finite and ``range_min <= r <= range_max``."""

    def __post_init__(self) -> None:
        require("angle_min", "angle_min", self.angle_min)
        require("angle_step", "size of angle_increment", abs(self.angle_increment))
        require("time_increment", "time_increment", self.time_increment)
        require("range", "range_min", self.range_min)
        require("range", "range_max", self.range_max)


@dataclass(frozen=True, slots=True)
class LaserScan:
    """One sweep; ``stamp`` is the time of the first beam."""

    stamp: float
    stream: str
    """Topic, or the record tag of the format."""
    frame: str
    """Name of the laser frame; empty when the format has none."""
    geometry: BeamGeometry
    ranges: Array
    """Metres; ``+inf`` = no return, NaN = invalid."""
    intensities: Array = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        require("stamp", "stamp", self.stamp)
        require("beams", "beams", len(self.ranges))
        last, geometry = len(self.ranges) - 1, self.geometry
        require("stamp", "stamp of the last beam", self.stamp + last * geometry.time_increment)
        require("angle_min", "bearing of the last beam", geometry.angle_min + last * geometry.angle_increment)

    @property
    def end(self) -> float:
        """Time of the last beam fired: a recorder writes the scan then [s]."""
        return self.stamp + max(0.0, (len(self.ranges) - 1) * self.geometry.time_increment)


@dataclass(frozen=True, slots=True)
class Odometry:
    """Pose of the vehicle in a frame that drifts."""

    stamp: float
    stream: str
    x: float
    y: float
    theta: float
    frame: str = "odom"
    child_frame: str = "base_link"

    def __post_init__(self) -> None:
        require("stamp", "stamp", self.stamp)
        require("coordinate", "x", self.x)
        require("coordinate", "y", self.y)
        require("angle", "theta", self.theta)


@dataclass(frozen=True, slots=True)
class JointState:
    """Positions [rad] and velocities [rad/s] of named joints; NaN where a message leaves them out."""

    stamp: float
    stream: str
    names: tuple[str, ...]
    positions: Array
    velocities: Array
    unit: Literal["rad", "tick"] = "rad"
    """Of the positions: counts where nobody knows how many make a turn."""

    def __post_init__(self) -> None:
        require("stamp", "stamp", self.stamp)
        require_all("joint", "positions", self.positions, or_nan=True)
        require_all("joint", "velocities", self.velocities, or_nan=True)


@dataclass(frozen=True, slots=True)
class Transform:
    """One edge of the frame tree."""

    stamp: float
    stream: str
    parent: str
    child: str
    translation: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    """x, y, z, w."""
    static: bool = False

    def __post_init__(self) -> None:
        require("stamp", "stamp", self.stamp)
        for value in (*self.translation, *self.quaternion):
            require("coordinate", f"transform {self.parent} -> {self.child}", value)


Message = LaserScan | Odometry | JointState | Transform
