"""What is in a recording, and what it can be used for: one pass over it, in bounded memory.

Rates are 1 / median of the stamp differences (of an even sample of them); a gap is a difference of more than five
medians and more than half a second. Order is judged in the order of the file: a step back is a stamp smaller than the
one before it in the same stream. An odometry jump is a step that no robot drives: half a metre and more at above 5 m/s,
or turning likewise.
Nothing is estimated here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from groma import _core
from groma.errors import UserError
from groma.io.recording import Recording
from groma.io.sampling import Sample
from groma.io.streams import Kind
from groma.nouns.findings import Finding
from groma.nouns.messages import BeamGeometry, JointState, LaserScan, Message, Odometry, Transform
from groma.recordings.drive import Drive, open_drive
from groma.recordings.wheels import is_of_sensor

GAP_MEDIANS, GAP_S = 5.0, 0.5
_KIND_OF: dict[type, Kind] = {
    LaserScan: Kind.SCAN,
    Odometry: Kind.ODOMETRY,
    JointState: Kind.JOINTS,
    Transform: Kind.TRANSFORM,
}


@dataclass(slots=True)
class Timing:
    """Stamps of one stream."""

    count: int = 0
    first: float = math.nan
    """First and last stamp in the order of the file [s]."""
    last: float = math.nan
    backward: int = 0
    largest_back_s: float = 0.0
    repeats: int = 0
    longest_gap_s: float = 0.0
    _newest: float = -math.inf
    _steps: Sample[float] = field(default_factory=Sample)

    def add(self, stamp: float) -> None:
        """Count one stamp."""
        self.count += 1
        if math.isfinite(self.last):
            self._step(stamp - self.last)
        else:
            self.first = stamp
        self.last = stamp
        self._newest = max(self._newest, stamp)

    def _step(self, step: float) -> None:
        if step < 0:
            self.backward += 1
            self.largest_back_s = max(self.largest_back_s, -step)
        elif step == 0:
            self.repeats += 1
        else:
            self._steps.offer(step)
            if self.last >= self._newest:
                self.longest_gap_s = max(self.longest_gap_s, step)

    @property
    def rate_hz(self) -> float:
        """Messages per second; NaN when unknown."""
        return 1.0 / float(np.median(self._steps.kept)) if self._steps.kept else math.nan

    @property
    def has_gap(self) -> bool:
        """Whether the stream pauses at least once."""
        return self.longest_gap_s > max(GAP_S, GAP_MEDIANS / self.rate_hz)


@dataclass(slots=True)
class ScanStream:
    """What the scans of one stream are like."""

    frame: str = ""
    beams: set[int] = field(default_factory=set)
    geometry: BeamGeometry | None = None
    """Of the first scan."""
    geometries_differ: bool = False
    readings: int = 0
    hits: int = 0
    no_returns: int = 0
    invalid: int = 0
    longest_hit_m: float = 0.0
    with_intensities: int = 0

    def add(self, scan: LaserScan) -> None:
        """Count one scan."""
        if self.geometry is None:
            self.frame, self.geometry = scan.frame, scan.geometry
        self.geometries_differ |= scan.geometry != self.geometry
        self.beams.add(len(scan.ranges))
        hits = scan.ranges[np.isfinite(scan.ranges)]
        invalid = int(np.count_nonzero(np.isnan(scan.ranges)))
        self.readings += len(scan.ranges)
        self.hits += len(hits)
        self.invalid += invalid
        self.no_returns += len(scan.ranges) - len(hits) - invalid
        self.longest_hit_m = max(self.longest_hit_m, float(hits.max(initial=0.0)))
        self.with_intensities += len(scan.intensities) > 0


@dataclass(slots=True)
class OdometryStream:
    """Where the odometry of one stream goes."""

    frame: str = ""
    child_frame: str = ""
    path_m: float = 0.0
    turned_rad: float = 0.0
    jumps: int = 0
    largest_step_m: float = 0.0
    _before: Odometry | None = None

    def add(self, pose: Odometry) -> None:
        """Take one pose."""
        self.frame, self.child_frame = pose.frame, pose.child_frame
        if self._before is not None:
            self._step(self._before, pose)
        self._before = pose

    def _step(self, before: Odometry, pose: Odometry) -> None:
        way = math.hypot(pose.x - before.x, pose.y - before.y)
        turn = pose.theta - before.theta
        self.path_m += way
        self.turned_rad += abs(math.remainder(turn, 2 * math.pi))
        self.largest_step_m = max(self.largest_step_m, way)
        self.jumps += _core.odometry_jumps(_row(before), _row(pose))


def _row(pose: Odometry) -> tuple[float, float, float, float]:
    return (pose.stamp, pose.x, pose.y, pose.theta)


@dataclass(slots=True)
class Use:
    """Whether a command can work with the recording."""

    command: str
    possible: bool
    why: str
    """What it lacks, or what it would work with."""


@dataclass(slots=True)
class Inspection:
    """Everything that `groma inspect` tells."""

    path: str
    format: str
    timings: dict[tuple[str, Kind], Timing] = field(default_factory=dict)
    scans: dict[str, ScanStream] = field(default_factory=dict)
    odometry: dict[str, OdometryStream] = field(default_factory=dict)
    joints: dict[str, tuple[str, ...]] = field(default_factory=dict)
    edges: dict[tuple[str, str], bool] = field(default_factory=dict)
    """Transforms ``(parent, child)``: whether static."""
    angle_max_excess: dict[str, float] = field(default_factory=dict)
    drive: list[str] = field(default_factory=list)
    """What a map would be made of, in sentences."""
    findings: list[Finding] = field(default_factory=list)
    uses: list[Use] = field(default_factory=list)

    def add(self, message: Message) -> None:
        """Take one message."""
        key = (message.stream, _KIND_OF[type(message)])
        timing = self.timings.get(key)
        if timing is None:
            timing = self.timings[key] = Timing()
        timing.add(message.stamp)
        if isinstance(message, LaserScan):
            self.scans.setdefault(message.stream, ScanStream()).add(message)
        elif isinstance(message, Odometry):
            self.odometry.setdefault(message.stream, OdometryStream()).add(message)
        elif isinstance(message, JointState):
            self.joints.setdefault(message.stream, message.names)
        else:
            self.edges.setdefault((message.parent, message.child), message.static)

    @property
    def duration_s(self) -> float:
        """From the earliest first to the latest last stamp of scans, odometry and joints; NaN without any."""
        spans = [t for (_, kind), t in self.timings.items() if kind is not Kind.TRANSFORM and math.isfinite(t.first)]
        if not spans:
            return math.nan
        return max(max(t.first, t.last) for t in spans) - min(min(t.first, t.last) for t in spans)


def inspect(recording: Recording, progress: Callable[[int], None] | None = None) -> Inspection:
    """Read a recording through and tell what is in it.

    Parameters
    ----------
    recording
        Read once to its end, and once a little way in.
    progress
        Called with the number of messages read so far, every thousand.
    """
    found = Inspection(str(recording.path), recording.format)
    drive = _look_at_drive(recording, found)
    for count, message in enumerate(recording.messages(), 1):
        found.add(message)
        if progress is not None and count % 1000 == 0:
            progress(count)
    found.angle_max_excess = dict(recording.notes.angle_max_excess)
    found.findings += recording.notes.findings()
    if drive is not None and drive.odometry is not None:
        _compare_clocks(found, drive.scans, drive.odometry)
    found.uses = list(_uses(found, drive is not None and drive.mount_known))
    return found


def _look_at_drive(recording: Recording, found: Inspection) -> Drive | None:
    try:
        drive = open_drive(recording)
    except UserError:  # no scans: told under what the recording can serve
        return None
    found.drive = [f"scans from {drive.scans}", f"odometry from {drive.odometry or 'none'}"]
    found.findings = list(drive.notes)
    return drive


def _compare_clocks(found: Inspection, scans: str, odometry: str) -> None:
    """Tell when scans and odometry are of different times: one of them will be left out as late."""
    a, b = found.timings.get((scans, Kind.SCAN)), found.timings.get((odometry, Kind.ODOMETRY))
    if a is None or b is None:
        return
    common = min(a.last, b.last) - max(a.first, b.first)
    if common < 0.5 * min(a.last - a.first, b.last - b.first):
        text = f"the times of {scans} and {odometry} hardly overlap: different clocks, or recorded one after the other"
        found.findings.append(Finding("clocks-differ", text, span=(min(a.first, b.first), max(a.last, b.last))))


def _uses(found: Inspection, mount_known: bool) -> list[Use]:
    """Return which commands the recording can serve; a command is listed when it exists."""
    scans = sum(timing.count for (_, kind), timing in found.timings.items() if kind is Kind.SCAN)
    has_odometry = any(line.startswith("odometry from ") and not line.endswith(" none") for line in found.drive)
    mapping = "with odometry" if has_odometry else "scans alone, as with --odometry none"
    if not mount_known:
        mapping += "; where the laser sits is not in it and is taken as zero"
    return [_use("groma map", ["laser scans"] if scans < 2 else [], mapping), _calibration(found, scans)]


def _calibration(found: Inspection, scans: int) -> Use:
    """Tell whether a vehicle can be calibrated: by joints or odometry, and scans or poses of the sensor."""
    tracked = [name for name, stream in found.odometry.items() if is_of_sensor(stream.child_frame)]
    wheels = list(found.joints) or [name for name in found.odometry if name not in tracked]
    lacks = [] if wheels else ["wheels: joint states, ticks or odometry"]
    if scans < 2 and not tracked:
        lacks.append("laser scans or poses of the sensor")
    sensor = "scans" if scans >= 2 else f"poses of the sensor, {', '.join(tracked)}"
    made = "wheels" if found.joints else "a differential drive, its wheels made from odometry"
    return _use("groma calibrate vehicle", lacks, f"{made} of {', '.join(wheels)} and {sensor}")


def _use(command: str, lacks: list[str], works_with: str) -> Use:
    return Use(command, not lacks, f"lacks {' and '.join(lacks)}" if lacks else works_with)
