"""A first look through a CARMEN log, for what its lines leave open: the clock, the no-return value, the mounting.

At most ``LOOKED_AT`` bytes are read and ``SAMPLE`` scans of each tag are kept, spread evenly over what was read (when
the sample is full, every second scan is dropped and the stride doubles), so memory and time are bounded.

Clock: the first of ipc time, logger time whose values on successive scans nearly all differ and mostly grow. Six-digit
printing makes epoch times equal, simulators write zeros; then scans get the times 0, 1, 2, ... seconds.

Mounting: T_base_laser = T_odom_base^-1 T_odom_laser of the two poses on a line. It counts when it is the same on all
lines; where it is not (the laser pose was corrected, the robot pose was not) it says nothing.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from groma.io import beams
from groma.io.carmen_lines import (
    LineError,
    ScanLine,
    Tokens,
    parse_flaser,
    parse_odom,
    parse_rawlaser,
    parse_robotlaser,
)
from groma.io.notes import Notes
from groma.io.sampling import SAMPLE, Sample
from groma.io.text_lines import numbered_lines
from groma.nouns.arrays import Array
from groma.nouns.bounds import OutOfRangeError
from groma.nouns.poses import Pose, relative_pose

LOOKED_AT = 64 << 20
SYNTHETIC_PERIOD = 1.0
"""Seconds between scans when the log has no usable times."""
RIGID_M, RIGID_RAD = 0.01, math.radians(0.5)
"""Mountings that differ by less are the same mounting, printed with few digits."""

SCAN_PARSERS: dict[bytes, Callable[[Tokens], ScanLine]] = {
    b"FLASER": parse_flaser,
    b"RLASER": parse_flaser,
    **{b"RAWLASER%d" % k: parse_rawlaser for k in range(1, 6)},
    **{b"ROBOTLASER%d" % k: parse_robotlaser for k in range(1, 6)},
}


@dataclass(slots=True)
class ScanTraits:
    """What a sample tells about one scan tag."""

    no_return: float | None
    mount: Pose | None
    """T_base_laser; None when unknown."""
    why_no_mount: str
    moved: bool
    """Whether the robot poses on the lines change at all."""


@dataclass(slots=True)
class Survey:
    """What the first look found."""

    counts: Counter[str]
    """Lines by tag, up to where it looked."""
    whole: bool
    """Whether it looked at the whole file."""
    parameters: dict[str, str]
    clock: str
    """``ipc``, ``logger``, ``seconds and microseconds`` or ``none``."""
    stamp_fields: dict[str, int]
    """Fields that most lines of a tag have at their end for the times."""
    scans: dict[str, ScanTraits]


def survey(path: Path) -> Survey:
    """Look through a log.

    Parameters
    ----------
    path
        CARMEN log, plain or gzipped.
    """
    look = _Look()
    whole = look.through(path)
    scans = {tag.decode(): _traits(tag, sample) for tag, sample in look.samples.items()}
    usual = {
        tag.decode(): Counter(map(len, look.stamps(tag))).most_common(1)[0][0] for tag in look.first if look.stamps(tag)
    }
    return Survey(look.counts, whole, look.parameters, choose_clock(look.main_stamps()), usual, scans)


class _Look:
    """What is gathered line by line."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.parameters: dict[str, str] = {}
        self.samples: dict[bytes, Sample[bytes]] = {}
        self.first: dict[bytes, list[bytes]] = {}

    def through(self, path: Path) -> bool:
        """Read up to the limit; whether that was the whole file."""
        looked = 0
        for _, line in numbered_lines(path, Notes()):
            looked += len(line)
            if looked > LOOKED_AT:
                return False
            tag, _, _ = line.lstrip().partition(b" ")
            if tag.strip() and not tag.startswith(b"#"):
                self._take(tag.strip(), line)
        return True

    def _take(self, tag: bytes, line: bytes) -> None:
        self.counts[tag.decode(errors="replace")] += 1
        if tag in SCAN_PARSERS:
            self.samples.setdefault(tag, Sample()).offer(line)
        if tag in SCAN_PARSERS or tag == b"ODOM":
            successive = self.first.setdefault(tag, [])
            if len(successive) < SAMPLE:
                successive.append(line)
        elif tag == b"PARAM":
            _take_parameter(line, self.parameters)

    def main_stamps(self) -> list[Tokens]:
        """Return the stamp fields of the first successive lines of a scan tag, of ODOM when there is no scan."""
        tags = [tag for tag in self.first if tag in SCAN_PARSERS] or list(self.first)
        return self.stamps(tags[0]) if tags else []

    def stamps(self, tag: bytes) -> list[Tokens]:
        """Return the stamp fields of the first successive lines of a tag."""
        return [stamps for line in self.first[tag] if (stamps := _stamp_fields(tag, line)) is not None]


def _stamp_fields(tag: bytes, line: bytes) -> Tokens | None:
    try:
        return parse_odom(line.split())[1] if tag == b"ODOM" else SCAN_PARSERS[tag](line.split()).stamps
    except (LineError, OutOfRangeError):
        return None


def choose_clock(stamps: list[Tokens]) -> str:
    """Return the clock for the stamp fields of successive lines; see the head of this file."""
    fields = Counter(map(len, stamps)).most_common(1)[0][0] if stamps else 0
    if fields < 2:
        return "none"
    stamps = [s for s in stamps if len(s) == fields]
    first, last = (_numbers([s[k] for s in stamps]) for k in (0, fields - 1))
    if fields == 3 and _are_seconds_and_microseconds(stamps, first, last):
        return "seconds and microseconds"
    if _runs(first):
        return "ipc"
    return "logger" if fields == 3 and _runs(last) else "none"


def _numbers(column: Iterable[bytes]) -> Array:
    def value(token: bytes) -> float:
        try:
            return float(token)
        except ValueError:
            return math.nan

    return np.array([value(token) for token in column])


def _are_seconds_and_microseconds(stamps: list[Tokens], first: Array, last: Array) -> bool:
    whole = all(fields[0].isdigit() and fields[2].isdigit() for fields in stamps)
    return whole and bool(first.min() > 1e8 and last.max() < 1e6)


def _runs(times: Array) -> bool:
    """Whether times of successive lines can be a clock; a single one can."""
    finite = np.isfinite(times)
    if finite.mean() < 0.95:
        return False
    steps = np.diff(times[finite])
    if not len(steps):
        return bool(times.any())
    return bool((steps != 0).mean() >= 0.95 and (steps > 0).mean() >= 0.8)


def _take_parameter(line: bytes, parameters: dict[str, str]) -> None:
    fields = line.decode(errors="replace").split()
    if len(fields) >= 3:
        parameters[fields[1]] = fields[2]


def _traits(tag: bytes, sample: Sample[bytes]) -> ScanTraits:
    parsed = [scan for line in sample.kept if (scan := _parsed(tag, line)) is not None]
    positions = [scan.robot[:2] if scan.robot else (0.0, 0.0) for scan in parsed]
    no_return = beams.infer_no_return([scan.ranges for scan in parsed], positions)
    poses = np.array([scan.robot for scan in parsed if scan.robot]).reshape(-1, 3)
    moved = len(poses) > 1 and bool(np.ptp(poses, axis=0).max() > 0)
    mount, why = _common_mount(parsed)
    return ScanTraits(no_return, mount, why, moved)


def _parsed(tag: bytes, line: bytes) -> ScanLine | None:
    try:
        return SCAN_PARSERS[tag](line.split())
    except (LineError, OutOfRangeError):
        return None


def mount_of(laser: Pose, robot: Pose) -> Pose:
    """Return T_base_laser = T_odom_base^-1 T_odom_laser."""
    return relative_pose(robot, laser)


def differ(a: Pose, b: Pose) -> bool:
    """Whether two mountings are not the same one."""
    x, y, turn = relative_pose(a, b)
    return math.hypot(x, y) > RIGID_M or abs(turn) > RIGID_RAD


def _common_mount(scans: list[ScanLine]) -> tuple[Pose | None, str]:
    mounts = [mount_of(scan.laser, scan.robot) for scan in scans if scan.laser and scan.robot]
    mounts = [m for m in mounts if all(map(math.isfinite, m))]
    if not mounts:
        return None, "no line has both a laser and a robot pose"
    middle = (float(np.median([m[0] for m in mounts])), float(np.median([m[1] for m in mounts])), mounts[0][2])
    apart = sum(differ(m, middle) for m in mounts)
    if apart > 0.05 * len(mounts):
        return None, "the laser pose moves against the robot pose, so one of them was corrected by another program"
    return middle, ""
