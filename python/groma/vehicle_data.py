"""From a recording to what calibration takes: readings of the wheels, and motions of the laser with their covariances.

The motions come from laser scans (:mod:`groma.egomotion`), or, where a recording has none, from poses of the sensor
that somebody else measured: a tracker, another program's laser odometry, tuples of scan matching. What is left out is
counted by reason.

Neighbouring motions of a drive share a scan, and with it half of their errors: the covariance of a motion and the
next is ``-C Ad(T_{k+1}^-1)^T``, with C the covariance that the shared scan brings: the errors of a motion are taken
to come from both its ends alike, and of the halves of two neighbours C is the lesser.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma.calibration import OdometryLog, SensorMotions
from groma.egomotion import Progress, laser_motions
from groma.errors import EstimationError, UserError
from groma.evaluation.se2 import relative
from groma.findings import Finding
from groma.io.drive_choice import choose_scans
from groma.io.recording import Recording
from groma.io.streams import Kind as StreamKind
from groma.io.time_order import Sorter
from groma.io.wheels import Wheels, is_of_sensor, read_wheels
from groma.models import LaserScan, Odometry
from groma.vehicle import Model
from groma.vehicle_segments import Segments, segments, turned

Array = NDArray[np.float64]

_SHARE = 0.49
"""Part of a motion's covariance that one of its ends brings: a half, less a little that keeps the whole positive."""
BREAK_MARGIN = 0.2
"""A motion this near to a break of the wheels is left out: a delay may reach across [s]."""


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
    """Motions used, and what was left out by reason."""
    notes: tuple[Finding, ...]
    """What was chosen and repaired."""


def vehicle_data(
    recording: Recording,
    model: Model,
    *,
    wheels: str | None = None,
    joints: tuple[str, ...] = (),
    axle: float = 1.0,
    scans: str | None = None,
    poses: str | None = None,
    window: float | None = None,
    progress: Progress | None = None,
) -> VehicleData:
    """Read a recording for the calibration of a vehicle.

    Parameters
    ----------
    recording
        An open recording.
    model
        What drives.
    wheels, joints
        Stream and names of the joints; chosen when left out.
    axle
        Wheel separation by which odometry was made, where it stands for wheels [m].
    scans
        Name of the scan stream; chosen when None.
    poses
        Name of an odometry stream with poses of the sensor, to be used instead of scans.
    window
        Length of a window [s]; None: stop and go where the drive is.
    progress
        Called with the number of scans read.

    Raises
    ------
    UserError
        When the recording has no wheels, or nothing that tells how the sensor moved.
    EstimationError
        When no motion is left.
    """
    read = read_wheels(recording, model, stream=wheels, joints=joints, axle=axle)
    cut = segments(read, model, window)
    counts: Counter[str] = Counter()
    notes = list(read.findings)
    name, of_scans = _sensor(recording, scans, poses, notes)
    if of_scans:
        found = _from_scans(recording, name, cut, counts, progress)
    else:
        cut, found = _from_poses(recording, name, cut, window, counts)
    motions = _gated(found, read, model, counts)
    source = f"scans of {name}" if of_scans else f"poses of the sensor from {name}"
    steering = None if model == "differential" else read.readings[:, 1]
    log = OdometryLog(read.time, read.readings[:, : 2 if steering is None else 1], steering)
    return VehicleData(log, motions, read, cut, source, counts, tuple(notes))


@dataclass(frozen=True, slots=True)
class _Found:
    """Motions before the gates."""

    start: Array
    end: Array
    motion: Array
    covariance: Array | None
    verdict: tuple[str, ...]


def _sensor(recording: Recording, scans: str | None, poses: str | None, notes: list[Finding]) -> tuple[str, bool]:
    """Return the stream that tells how the sensor moved, and whether it has scans."""
    if poses is not None:
        there = [s.name for s in recording.streams if s.kind is StreamKind.ODOMETRY]
        if poses not in there:
            raise UserError(f"{recording.path}: no poses called {poses}: there are {', '.join(there) or 'none'}")
        return poses, False
    if scans is not None or any(s.kind is StreamKind.SCAN for s in recording.streams):
        return choose_scans(recording, scans, notes), True
    for message in recording.messages({s.name for s in recording.streams if s.kind is StreamKind.ODOMETRY}):
        if isinstance(message, Odometry) and is_of_sensor(message.child_frame):
            return message.stream, False
    raise UserError(f"{recording.path}: neither laser scans in it nor poses of the sensor (--poses names their stream)")


def _from_scans(
    recording: Recording, name: str, cut: Segments, counts: Counter[str], progress: Progress | None
) -> _Found:
    found = laser_motions(_sorted_scans(recording, name, counts), cut.stations, progress)
    counts.update(found.skipped)
    return _Found(found.start, found.end, found.motion, found.covariance, found.verdict)


def _sorted_scans(recording: Recording, name: str, counts: Counter[str]) -> Iterator[LaserScan]:
    sorter: Sorter[LaserScan] = Sorter(counts)
    for message in recording.messages({name}):
        if isinstance(message, LaserScan) and message.stream == name:
            yield from sorter.push(message.stamp, 0, message, "scans")
    yield from sorter.drain()


def _from_poses(
    recording: Recording, name: str, cut: Segments, window: float | None, counts: Counter[str]
) -> tuple[Segments, _Found]:
    """Return the motions between poses of the sensor: the mean of a standstill, the first from a moment on."""
    read = [
        (m.stamp, m.x, m.y, m.theta) for m in recording.messages({name}) if isinstance(m, Odometry) and m.stream == name
    ]
    table = np.array(read, dtype=np.float64).reshape(-1, 4)
    good = _complete(table)
    counts["poses of the sensor that are no number"] += int((~good).sum())
    table = table[good][np.argsort(table[good][:, 0], kind="stable")]
    table = table[np.concatenate([[True], np.diff(table[:, 0]) > 0])[: len(table)]]
    table[:, 3] = np.unwrap(table[:, 3])
    if len(table) > 1 and cut.kind == "windows" and window is None and np.median(np.diff(table[:, 0])) > 0.3:
        cut = Segments("windows", np.column_stack([table[:, 0], table[:, 0]]))
    at = _poses_at(table, cut.stations)
    return cut, _between(at)


def _complete(rows: Array) -> NDArray[np.bool_]:
    return np.array([np.isfinite(row).all() for row in rows], dtype=np.bool_)


def _poses_at(table: Array, stations: Array) -> Array:
    """Return time and pose (n, 4) of the stations; NaN where there is none."""
    out = np.full((len(stations), 4), np.nan)
    first = np.searchsorted(table[:, 0], stations[:, 0])
    last = np.searchsorted(table[:, 0], stations[:, 1], side="right")
    for k, (i, j) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
        if stations[k, 1] > stations[k, 0]:
            if j > i:
                out[k] = [stations[k].mean(), *table[i:j, 1:].mean(axis=0)]
        elif i < len(table):
            out[k] = table[i]
    return out


def _between(at: Array) -> _Found:
    motion = relative(at[:-1, 1:], at[1:, 1:])
    motion[:, 2] = np.diff(at[:, 3])
    seen = _complete(at)
    good = seen[1:] & seen[:-1] & (np.diff(at[:, 0]) > 0)
    verdict = tuple("" if ok else "no pose at one of its ends" for ok in good)
    return _Found(at[:-1, 0], at[1:, 0], motion, None, verdict)


def _gated(found: _Found, wheels: Wheels, model: Model, counts: Counter[str]) -> SensorMotions:
    """Return the motions that count, in order of time; the others are counted by reason."""
    reasons = np.array([f"motions: {why}" if why else "" for why in found.verdict], dtype=object)
    outside = (found.start < wheels.time[0]) | (found.end > wheels.time[-1])
    reasons[(reasons == "") & outside] = "motions: no wheels at one of their ends"
    for begin, end in wheels.breaks:
        across = (found.start < end + BREAK_MARGIN) & (found.end > begin - BREAK_MARGIN)
        reasons[(reasons == "") & across] = "motions: the readings of the wheels are broken on the way"
    idle = np.zeros(len(reasons), dtype=bool)
    usable = reasons == ""
    idle[usable] = ~turned(wheels, model, found.start[usable], found.end[usable])
    reasons[idle] = "motions: the wheels stood"
    counts.update(str(why) for why in reasons if why)
    keep = reasons == ""
    counts["motions used"] = int(keep.sum())
    if not keep.any():
        left_out = ", ".join(f"{n} {why}" for why, n in sorted(counts.items()) if n and why.startswith("motions: "))
        raise EstimationError(f"no motion of the sensor to calibrate by ({left_out or 'the vehicle never drove'})")
    start, end, motion = found.start[keep], found.end[keep], found.motion[keep]
    if found.covariance is None:
        return SensorMotions(start, end, motion)
    covariance = found.covariance[keep]
    return SensorMotions(start, end, motion, covariance, _coupling(start, end, motion, covariance))


def _coupling(start: Array, end: Array, motion: Array, covariance: Array) -> Array:
    """Return the covariance (m - 1, 3, 3) of each motion and the next, zero where they share no scan."""
    back = _adjoint_of_inverse(motion[1:])
    forth = np.linalg.inv(back) if len(back) else back
    before = _SHARE * covariance[:-1]
    after = _SHARE * forth @ covariance[1:] @ forth.transpose(0, 2, 1)
    shared = (np.abs(start[1:] - end[:-1]) < 1e-6).astype(np.float64)
    coupling: Array = -shared[:, None, None] * (_lesser(before, after) @ back.transpose(0, 2, 1))
    return coupling


def _lesser(a: Array, b: Array) -> Array:
    """Return the greatest covariance that exceeds neither of two (m, 3, 3) in the directions that they share."""
    root = np.linalg.cholesky(a)
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse @ b @ inverse.transpose(0, 2, 1))
    turned = root @ vectors
    lesser: Array = turned * np.minimum(values, 1.0)[:, None, :] @ turned.transpose(0, 2, 1)
    return lesser


def _adjoint_of_inverse(motion: Array) -> Array:
    x, y, cos, sin = motion[:, 0], motion[:, 1], np.cos(motion[:, 2]), np.sin(motion[:, 2])
    back = np.zeros((len(motion), 3, 3))
    back[:, 0] = np.column_stack([cos, sin, x * sin - y * cos])
    back[:, 1] = np.column_stack([-sin, cos, x * cos + y * sin])
    back[:, 2, 2] = 1.0
    return back
