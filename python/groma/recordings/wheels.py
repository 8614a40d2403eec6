"""The wheels of a recording: which joints are the driven wheels and the steering, by stream and name.

Choice when not told: the joint stream with most messages; in it, for a tricycle, the joint whose name has ``steer`` in
it and the one called traction, drive, front or wheel; for a differential drive those called left and right. A
recording that has no joints but odometry of a differential drive can serve: the wheels that would have made it are
then "read", so that the radii found are factors on the wheels of that odometry, and the axle one on
its separation.

What the readings say (order, counters that wrap, joints in messages of their own, gaps, leaps) is the business of the
one reader of wheels in the core, crate ``pipeline``; what it left out or had to break are its findings.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from groma import _core
from groma.errors import UserError
from groma.io.recording import Recording
from groma.io.streams import Kind
from groma.nouns.arrays import Array
from groma.nouns.findings import Finding, of_core
from groma.nouns.messages import JointState, Odometry
from groma.nouns.vehicle import JOINTS, Model, Unit, Vehicle

LEAST = 3
"""Readings of both joints without which there is nothing to work with."""
SENSOR_FRAMES = ("laser", "sensor", "lidar", "scan")
"""A frame with one of these words in its name is that of the sensor, not of the vehicle."""
_LOOK = 100
"""Messages after which all joints have been met."""
_PATTERNS = {
    "traction": re.compile(r"traction|drive|front|wheel|motor", re.IGNORECASE),
    "steering": re.compile(r"steer", re.IGNORECASE),
    "left": re.compile(r"left|(^|_)l(_|$)", re.IGNORECASE),
    "right": re.compile(r"right|(^|_)r(_|$)", re.IGNORECASE),
}


@dataclass(frozen=True, slots=True)
class Wheels:
    """Readings of the wheels; times strictly rising."""

    time: Array
    """(n,) [s]."""
    readings: Array
    """(n, 2) in the order of ``JOINTS``: counters unrolled, a steering angle [rad]."""
    joints: tuple[str, ...]
    """Names of the joints; empty when they were made from odometry."""
    unit: Unit
    breaks: Array
    """(b, 2) times between which the readings do not hang together [s]."""
    findings: tuple[Finding, ...] = ()
    """What was chosen, left out, unrolled, and where the log is broken."""

    def dead_reckoning(self, vehicle: Vehicle) -> Array:
        """Return the poses (n, 3) that the readings tell: x, y [m], heading with turns counted [rad].

        The first is zero; across a break the vehicle stays where it was.
        """
        broken: list[int] = np.searchsorted(self.time, self.breaks[:, 1]).tolist()
        return _core.dead_reckoning(vehicle.to_json(), self.readings, broken)


@dataclass(frozen=True, slots=True)
class WheelChoice:
    """Which messages of a recording are the readings of the wheels."""

    stream: str
    kind: Kind
    """Joints, or odometry of which wheels are made."""
    joints: tuple[str, ...]
    """Names of the joints; empty when they are made from odometry."""
    unit: Unit
    axle: float
    """Wheel separation by which odometry was made, where it represents wheels [m]."""
    lateness: float
    """How late readings come, at most [s]."""
    findings: tuple[Finding, ...]
    """What was chosen."""

    def positions(self, message: JointState) -> list[tuple[int, float]]:
        """Return which joint reads what in a message of the stream."""
        read = zip(message.names, message.positions.tolist(), strict=True)
        return [(self.joints.index(name), value) for name, value in read if name in self.joints]


def choose_wheels(
    recording: Recording, model: Model, *, stream: str | None = None, joints: Sequence[str] = (), axle: float = 1.0
) -> WheelChoice:
    """Choose the wheels of a vehicle; parameters and errors as in :func:`read_wheels`."""
    return _choice(recording, model, stream, joints, axle)[0]


def read_wheels(
    recording: Recording, model: Model, *, stream: str | None = None, joints: Sequence[str] = (), axle: float = 1.0
) -> Wheels:
    """Read the wheels of a vehicle.

    Parameters
    ----------
    recording
        An open recording.
    model
        What drives.
    stream
        Name of the joint or odometry stream; chosen when None.
    joints
        Names of the joints in the order of ``JOINTS``; chosen when empty.
    axle
        Wheel separation by which odometry was made, where it represents wheels [m].

    Raises
    ------
    UserError
        When there are no wheels in it, or they cannot be distinguished; the message lists what there is.
    """
    choice, table = _choice(recording, model, stream, joints, axle)
    if choice.kind is Kind.ODOMETRY:
        rows = _core.read_odometry_as_wheels(table, axle)
    else:
        rows = _core.read_wheels(model != "differential", table)
    return _wheels(recording, rows, choice.joints, choice.unit, list(choice.findings))


def _choice(
    recording: Recording, model: Model, stream: str | None, joints: Sequence[str], axle: float
) -> tuple[WheelChoice, Array]:
    """Return the choice, and the readings as rows: of odometry, or of two joints called 0 and 1."""
    name, kind, found = _stream(recording, model, stream)
    if kind is Kind.ODOMETRY:
        made = f"no joints: wheels made from the odometry {name}, {axle:g} m apart; radii are factors on its wheels"
        table = _odometry_table(recording, name)
        found.append(Finding("wheels-from-odometry", made))
        return WheelChoice(name, kind, (), "rad", axle, _core.stamp_disorder(table[:, 0].tolist()), tuple(found)), table
    read, names, unit = _joint_table(recording, name)
    chosen = _joints(recording, name, names, model, joints)
    if not joints:
        told = ", ".join(f"{joint} ({what})" for joint, what in zip(chosen, JOINTS[model], strict=True))
        found.append(Finding("joints-chosen", f"joints of {name}: {told}"))
    table = _chosen(recording, name, read, [names[n] for n in chosen])
    lateness = max(_core.stamp_disorder(table[table[:, 1] == joint, 0].tolist()) for joint in (0, 1))
    return WheelChoice(name, kind, chosen, unit, axle, lateness, tuple(found)), table


def steers(recording: Recording, stream: str | None = None, joints: Sequence[str] = ()) -> bool:
    """Whether a joint of the recording is one that steers, by its name."""
    names = list(joints)
    if not names:
        streams = [s.name for s in recording.streams if s.kind is Kind.JOINTS and stream in (None, s.name)]
        for count, message in enumerate(recording.messages(streams)):
            if isinstance(message, JointState):
                names += message.names
            if count > _LOOK:
                break
    return any(_PATTERNS["steering"].search(name) for name in names)


def is_of_sensor(frame: str) -> bool:
    """Whether a frame is that of the sensor."""
    return any(word in frame.lower() for word in SENSOR_FRAMES)


def _stream(recording: Recording, model: Model, wanted: str | None) -> tuple[str, Kind, list[Finding]]:
    there = [s for s in recording.streams if s.kind in (Kind.JOINTS, Kind.ODOMETRY)]
    if wanted is not None:
        found = [s for s in there if s.name == wanted]
        if not found:
            raise UserError(f"{recording.path}: no wheels called {wanted}: {_listed(there)}")
        return found[0].name, found[0].kind, []
    kinds = (Kind.JOINTS, Kind.ODOMETRY) if model == "differential" else (Kind.JOINTS,)
    for kind in kinds:
        of_kind = sorted((s for s in there if s.kind is kind), key=lambda s: -(s.count or 0))
        if of_kind:
            taken = Finding("stream-chosen", f"several {kind} streams: {of_kind[0].name} taken; --wheels chooses")
            return of_kind[0].name, kind, [taken] if len(of_kind) > 1 else []
    raise UserError(f"{recording.path}: no wheels in it to calibrate a {model}: {_listed(there)}")


def _listed(streams: Iterable[object]) -> str:
    told = ", ".join(f"{s.name} ({s.kind})" for s in streams)  # type: ignore[attr-defined]
    return f"there is {told}" if told else "there are neither joint states nor odometry"


def _joint_table(recording: Recording, stream: str) -> tuple[Array, Mapping[str, int], Unit]:
    """Return stamp, index of the joint and position a row, in the order of arrival; the index by name; the unit."""
    rows: list[tuple[float, int, float]] = []
    names: dict[str, int] = {}
    unit: Unit = "rad"
    for message in recording.messages({stream}):
        if isinstance(message, JointState) and message.stream == stream:
            unit = message.unit
            for name, position in zip(message.names, message.positions.tolist(), strict=True):
                rows.append((message.stamp, names.setdefault(name, len(names)), position))
    return np.array(rows, dtype=np.float64).reshape(-1, 3), names, unit


def _chosen(recording: Recording, stream: str, table: Array, joints: Sequence[int]) -> Array:
    """Return the rows of two joints, called 0 and 1."""
    rows = table[np.isin(table[:, 1], joints)]
    if len(rows) and np.isnan(rows[:, 2]).all():
        raise UserError(
            f"{recording.path}: the joints of {stream} have no positions: record positions, not speeds alone"
        )
    rows[:, 1] = rows[:, 1] == joints[1]
    return rows


def _joints(
    recording: Recording,
    stream: str,
    names: Mapping[str, int],
    model: Model,
    wanted: Sequence[str],
) -> tuple[str, ...]:
    there = f"{recording.path}: joints of {stream}: {', '.join(names) or 'none'}"
    if wanted:
        missing = [name for name in wanted if name not in names]
        if missing or len(wanted) != len(JOINTS[model]):
            what = " and the ".join(JOINTS[model])
            raise UserError(f"{there}: --joints names the {what} joint among them, or joints of the vehicle file")
        return tuple(wanted)
    free, chosen = dict.fromkeys(names), {}
    for what in sorted(JOINTS[model], key=lambda w: w != "steering"):
        matches = [name for name in free if _PATTERNS[what].search(name)] or (list(free) if len(free) == 1 else [])
        if len(matches) != 1:
            raise UserError(
                f"{there}: {len(matches)} may be the {what} joint: name {' and '.join(JOINTS[model])} with --joints"
            )
        chosen[what] = matches[0]
        free.pop(matches[0])
    return tuple(chosen[what] for what in JOINTS[model])


def _odometry_table(recording: Recording, stream: str) -> Array:
    """Return stamp, x, y and heading a row, in the order of arrival."""
    read = [
        (m.stamp, m.x, m.y, m.theta)
        for m in recording.messages({stream})
        if isinstance(m, Odometry) and m.stream == stream
    ]
    return np.array(read, dtype=np.float64).reshape(-1, 4)


def _wheels(recording: Recording, rows: Any, joints: tuple[str, ...], unit: Unit, found: list[Finding]) -> Wheels:
    time, readings, breaks, findings = rows
    if len(time) < LEAST:
        raise UserError(f"{recording.path}: {len(time)} readings of the wheels are too few to calibrate by")
    return Wheels(time, readings, joints, unit, breaks, (*found, *of_core(findings)))
