"""What a calibration was made of: readings of the wheels, how the drive was cut, motions of the sensor.

All of it comes from the pipeline of the core (crate ``pipeline``, :mod:`groma.vehicle.recording`); here it has names.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Literal, cast

from groma import _core
from groma.nouns.arrays import Array
from groma.recordings.wheels import WheelChoice, Wheels
from groma.vehicle.calibration import OdometryLog, SensorMotions

Kind = Literal["stop and go", "windows"]


@dataclass(frozen=True, slots=True)
class Segments:
    """Stations in order of time; motions run from each to the next."""

    kind: Kind
    stations: Array
    """(n, 2) begin and end of a standstill, or twice the same moment [s]."""


@dataclass(frozen=True, slots=True)
class VehicleData:
    """Wheels and motions of a drive."""

    log: OdometryLog
    motions: SensorMotions
    wheels: Wheels
    segments: Segments
    source: str
    """What the motions come from, in words."""
    counts: Counter[str]
    """Motions used, and those left out by reason."""


def to_data(found: _core.CalibrationData, choice: WheelChoice, source: str, steered: bool) -> VehicleData:
    """Return what the core says a calibration was made of.

    Parameters
    ----------
    found
        From the core.
    choice
        The wheels of the recording.
    source
        What the motions come from, in words.
    steered
        Whether the second reading is a steering angle.
    """
    wheels = Wheels(found.time, found.readings, choice.joints, choice.unit, found.breaks, choice.findings)
    steering = wheels.readings[:, 1] if steered else None
    log = OdometryLog(wheels.time, wheels.readings[:, : 1 if steered else 2], steering)
    motions = SensorMotions(found.start, found.end, found.motion, found.covariance, found.coupling)
    counts = Counter(f"motions: {reason}" for reason, *_ in found.left_out)
    counts["motions used"] = len(motions.start)
    return VehicleData(log, motions, wheels, Segments(cast(Kind, found.kind), found.stations), source, counts)
