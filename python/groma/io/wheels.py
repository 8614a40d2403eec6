"""The wheels of a recording: which joints are the driven wheels and the steering, and their readings in order of time.

Choice when not told: the joint stream with most messages; in it, for a tricycle, the joint whose name has ``steer`` in
it and the one called traction, drive, front or wheel; for a differential drive those called left and right. A
recording that has no joints but odometry of a differential drive can serve: the wheels that would have made it are
then "read", so that the radii found are factors on the wheels of that odometry, and the axle one on
its separation.

Readings are sorted; those that are no numbers or repeat a time are left out and counted. Angles that jump by a turn are
unrolled, steering angles are taken within half a turn. Where a counter leaps (a reset) or readings are missing, the log
is broken: no motion is taken across.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.findings import Finding
from groma.io.recording import Recording
from groma.io.streams import Kind
from groma.models import JointState, Odometry
from groma.vehicle import JOINTS, Model, Unit

Array = NDArray[np.float64]

GAP = 0.5
"""Readings farther apart than this break the log [s], unless that is their usual rate."""
LEAP = 20.0
"""A counter that runs this many times faster than it ever usually does was reset."""
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
    skipped: Counter[str] = field(default_factory=Counter)
    """What was left out, by reason."""
    notes: tuple[Finding, ...] = ()
    """What was chosen and repaired."""


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
        Wheel separation by which odometry was made, where it stands for wheels [m].

    Raises
    ------
    UserError
        When there are no wheels in it, or they cannot be told apart; the message lists what there is.
    """
    name, kind, notes = _stream(recording, model, stream)
    if kind is Kind.ODOMETRY:
        table, skipped = _odometry_table(recording, name, axle)
        return _wheels(
            table,
            model,
            (),
            "rad",
            skipped,
            [*notes, Finding("wheels-from-odometry", _MADE_FROM_ODOMETRY.format(name, axle))],
        )
    columns, unit = _columns(recording, name)
    chosen = _joints(recording, name, columns, model, joints)
    if not joints:
        told = ", ".join(f"{joint} ({what})" for joint, what in zip(chosen, JOINTS[model], strict=True))
        notes.append(Finding("joints-chosen", f"joints of {name}: {told}"))
    table = _merged([columns[joint] for joint in chosen])
    return _wheels(table, model, chosen, unit, Counter(), notes)


_MADE_FROM_ODOMETRY = "no joints: wheels made from the odometry {}, {:g} m apart; radii are factors on its wheels"


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
            text = f"several {kind} streams: {of_kind[0].name} taken; --wheels chooses"
            return of_kind[0].name, kind, [] if len(of_kind) == 1 else [Finding("stream-chosen", text)]
    raise UserError(f"{recording.path}: no wheels in it to calibrate a {model}: {_listed(there)}")


def _listed(streams: Iterable[object]) -> str:
    told = ", ".join(f"{s.name} ({s.kind})" for s in streams)  # type: ignore[attr-defined]
    return f"there is {told}" if told else "there are neither joint states nor odometry"


def _columns(recording: Recording, stream: str) -> tuple[dict[str, list[tuple[float, float]]], Unit]:
    """Return times and positions of every joint of a stream."""
    columns: dict[str, list[tuple[float, float]]] = {}
    unit: Unit = "rad"
    for message in recording.messages({stream}):
        if isinstance(message, JointState) and message.stream == stream:
            unit = message.unit
            for name, position in zip(message.names, message.positions.tolist(), strict=True):
                columns.setdefault(name, []).append((message.stamp, position))
    return columns, unit


def _joints(
    recording: Recording,
    stream: str,
    columns: dict[str, list[tuple[float, float]]],
    model: Model,
    wanted: Sequence[str],
) -> tuple[str, ...]:
    there = f"{recording.path}: joints of {stream}: {', '.join(columns) or 'none'}"
    if wanted:
        missing = [name for name in wanted if name not in columns]
        if missing or len(wanted) != len(JOINTS[model]):
            raise UserError(f"{there}: --joints names the {' and the '.join(JOINTS[model])} joint among them")
        return tuple(wanted)
    free, chosen = dict.fromkeys(columns), {}
    for what in sorted(JOINTS[model], key=lambda w: w != "steering"):
        matches = [name for name in free if _PATTERNS[what].search(name)] or (list(free) if len(free) == 1 else [])
        if len(matches) != 1:
            raise UserError(
                f"{there}: {len(matches)} may be the {what} joint: name {' and '.join(JOINTS[model])} with --joints"
            )
        chosen[what] = matches[0]
        free.pop(matches[0])
    return tuple(chosen[what] for what in JOINTS[model])


def _merged(columns: list[list[tuple[float, float]]]) -> Array:
    """Return (n, 3) time and both readings; readings that come in messages of their own are interpolated."""
    first, second = (np.array(column, dtype=np.float64).reshape(-1, 2) for column in columns)
    if len(first) == len(second) and np.array_equal(first[:, 0], second[:, 0], equal_nan=True):
        return np.column_stack([first, second[:, 1]])
    good = second[np.isfinite(second).all(axis=1)]
    good = good[np.argsort(good[:, 0], kind="stable")]
    inside = (first[:, 0] >= good[0, 0]) & (first[:, 0] <= good[-1, 0]) if len(good) else np.zeros(len(first), bool)
    first = first[inside]
    return np.column_stack([first, np.interp(first[:, 0], good[:, 0], good[:, 1]) if len(first) else np.empty(0)])


def _odometry_table(recording: Recording, stream: str, axle: float) -> tuple[Array, Counter[str]]:
    """Return (n, 3) time and the angles of wheels of 1 m radius that would have made the odometry."""
    read = [
        (m.stamp, m.x, m.y, m.theta)
        for m in recording.messages({stream})
        if isinstance(m, Odometry) and m.stream == stream
    ]
    poses = np.array(read, dtype=np.float64).reshape(-1, 4)
    skipped: Counter[str] = Counter()
    poses, _ = _in_order(poses, skipped)
    step = np.diff(poses[:, 1:], axis=0)
    turn = np.arctan2(np.sin(step[:, 2]), np.cos(step[:, 2]))
    middle = poses[:-1, 3] + turn / 2
    chord = step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle)
    half, aside = turn / 2, turn * axle / 2
    way = chord * np.where(np.abs(half) > 1e-6, half / np.where(half == 0, 1.0, np.sin(half)), 1.0)
    sums = np.vstack([np.zeros((1, 2)), np.cumsum(np.column_stack([way - aside, way + aside]), axis=0)])
    return np.column_stack([poses[:, 0], sums[: len(poses)]]), skipped


def _wheels(
    table: Array, model: Model, joints: tuple[str, ...], unit: Unit, skipped: Counter[str], notes: list[Finding]
) -> Wheels:
    table, late = _in_order(table, skipped)
    if late:
        text = f"{late} readings of the wheels came late and were sorted in"
        notes.append(Finding("stamps-disordered", text, values={"count": (late, "1")}))
    if len(table) < 3:
        raise UserError(f"{len(table)} readings of the wheels are too few to calibrate by")
    counters = [1, 2] if model == "differential" else [1]
    for k in counters:
        if _rolls_over(table[:, k]):
            table[:, k] = np.unwrap(table[:, k])
            text = f"the angle of {joints[k - 1] if joints else 'a wheel'} jumps by whole turns: it was unrolled"
            notes.append(Finding("wheels-unrolled", text))
    if model != "differential":
        table[:, 2] = np.arctan2(np.sin(table[:, 2]), np.cos(table[:, 2]))
    breaks = _breaks(table, counters, skipped)
    return Wheels(table[:, 0], table[:, 1:], joints, unit, breaks, skipped, tuple(notes))


def _in_order(table: Array, skipped: Counter[str]) -> tuple[Array, int]:
    """Return the rows that are numbers, in order of time, each time once; and how many came late."""
    finite = np.isfinite(table).all(axis=1)
    skipped["readings of the wheels that are no number"] += int((~finite).sum())
    table = table[finite]
    late = int((np.diff(table[:, 0]) < 0).sum())
    table = table[np.argsort(table[:, 0], kind="stable")]
    fresh = np.concatenate([[True], np.diff(table[:, 0]) > 0])[: len(table)]
    skipped["readings of the wheels that repeat a time"] += int((~fresh).sum())
    return table[fresh], late


def _rolls_over(angles: Array) -> bool:
    """Whether an angle stays within a turn and jumps from one end of it to the other."""
    within = bool(np.ptp(angles) <= 2 * np.pi * 1.001)
    return within and bool((np.abs(np.diff(angles)) > np.pi).any())


def _breaks(table: Array, counters: list[int], skipped: Counter[str]) -> Array:
    """Return the intervals (b, 2) in which readings are missing or a counter leaps."""
    time = table[:, 0]
    dt = np.diff(time)
    broken = dt > max(GAP, 5 * float(np.median(dt)))
    skipped["gaps in the readings of the wheels"] += int(broken.sum())
    rates = np.abs(np.diff(table[:, counters], axis=0)) / dt[:, None]
    moving = rates[rates > 0]
    usual = float(np.percentile(moving, 95)) if len(moving) else 0.0
    leaps = (rates > LEAP * usual).any(axis=1) & ~broken
    skipped["leaps of a counter"] += int(leaps.sum())
    at = np.flatnonzero(broken | leaps)
    return np.column_stack([time[at], time[at + 1]])
