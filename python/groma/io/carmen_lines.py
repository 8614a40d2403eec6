"""The grammar of one line of a CARMEN log (formats of its writelog.c; angles [rad], lengths [m]).

    FLASER n r1..rn  laser_x laser_y laser_theta  robot_x robot_y robot_theta  STAMPS             (RLASER likewise)
    RAWLASERk   type start fov res maxrange accuracy remission_mode n r1..rn m e1..em  STAMPS
    ROBOTLASERk type start fov res maxrange accuracy remission_mode n r1..rn m e1..em
                laser_x laser_y laser_theta robot_x robot_y robot_theta tv rv fwd_safety side_safety turn_axis  STAMPS
    ODOM x y theta tv rv accel  STAMPS

STAMPS is ``ipc_time host logger_time``, ``seconds host microseconds``, ``ipc_time host`` or nothing. Some writers of
FLASER put n "too close" flags behind the ranges; the number of fields tells. A reading that is no number becomes NaN;
a line whose fields do not add up raises :class:`LineError`, a pose that no vehicle has OutOfRangeError.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groma.nouns.arrays import Array
from groma.nouns.bounds import require
from groma.nouns.poses import Pose

Tokens = Sequence[bytes]

MOST_BEAMS = 100_000
_ROBOT_FIELDS = 11
_STAMP_FIELDS = (0, 2, 3)


class LineError(ValueError):
    """The line is not what its tag promises; the message says why."""


@dataclass(frozen=True, slots=True)
class LaserConfig:
    """What a RAWLASER or ROBOTLASER line says about the scanner."""

    start: float
    fov: float
    resolution: float
    range_max: float


@dataclass(frozen=True, slots=True)
class ScanLine:
    """A line with ranges."""

    ranges: Array
    """(N,) as logged."""
    unreadable: int
    """Readings that were no number."""
    remissions: Array
    config: LaserConfig | None
    laser: Pose | None
    robot: Pose | None
    stamps: Tokens


def parse_flaser(tokens: Tokens) -> ScanLine:
    """Read FLASER and RLASER."""
    ranges, unreadable, at = parse_ranges(tokens, 1)
    count, rest = len(ranges), len(tokens) - at
    if count > 3 and rest - count - 6 in _STAMP_FIELDS:
        at += count
        rest -= count
    if rest - 6 not in _STAMP_FIELDS:
        raise LineError(f"{rest} fields after the {count} readings it announces, expected 9")
    laser, robot = _pose(tokens, at), _pose(tokens, at + 3)
    return ScanLine(ranges, unreadable, np.empty(0), None, laser, robot, tokens[at + 6 :])


def parse_rawlaser(tokens: Tokens) -> ScanLine:
    """Read RAWLASERk: no poses."""
    ranges, unreadable, remissions, at = _sensor(tokens)
    if len(tokens) - at not in _STAMP_FIELDS:
        raise LineError(f"{len(tokens) - at} fields after the readings and remissions it announces, expected 3")
    return ScanLine(ranges, unreadable, remissions, _config(tokens), None, None, tokens[at:])


def parse_robotlaser(tokens: Tokens) -> ScanLine:
    """Read ROBOTLASERk: laser and robot pose."""
    ranges, unreadable, remissions, at = _sensor(tokens)
    rest = len(tokens) - at - _ROBOT_FIELDS
    if rest not in _STAMP_FIELDS:
        raise LineError(f"{rest + _ROBOT_FIELDS} fields after the readings and remissions it announces, expected 14")
    laser, robot = _pose(tokens, at), _pose(tokens, at + 3)
    return ScanLine(ranges, unreadable, remissions, _config(tokens), laser, robot, tokens[at + _ROBOT_FIELDS :])


def parse_odom(tokens: Tokens) -> tuple[Pose, Tokens]:
    """Read ODOM: pose and stamp fields."""
    if len(tokens) - 7 not in _STAMP_FIELDS:
        raise LineError(f"{len(tokens) - 1} fields, expected 9")
    return _pose(tokens, 1), tokens[7:]


def parse_ranges(tokens: Tokens, at: int) -> tuple[Array, int, int]:
    """Read ``n r1 .. rn`` that begins at field ``at``: ranges, how many were no number, the index behind them."""
    count = _count(tokens, at)
    ranges, unreadable = _ranges(tokens, at + 1, count)
    return ranges, unreadable, at + 1 + count


def number(token: bytes, what: str) -> float:
    """Return a field as a number; NaN and infinity pass."""
    try:
        return float(token)
    except ValueError:
        raise LineError(f"{what} {_shown(token)} is not a number") from None


def _shown(token: bytes) -> str:
    return repr(token[:20].decode(errors="replace"))


def _count(tokens: Tokens, at: int) -> int:
    try:
        count = int(tokens[at])
    except (IndexError, ValueError):
        shown = _shown(tokens[at]) if at < len(tokens) else "(missing)"
        raise LineError(f"the number of readings {shown} is not a whole number") from None
    if not 0 <= count <= MOST_BEAMS:
        raise LineError(f"the number of readings {count} is out of reason")
    return count


def _ranges(tokens: Tokens, at: int, count: int) -> tuple[Array, int]:
    fields = tokens[at : at + count]
    if len(fields) < count or count == 0:
        raise LineError(f"announces {count} readings and has {len(fields)}")
    try:
        return np.fromiter(map(float, fields), np.float64, count), 0
    except ValueError:
        return _ranges_with_holes(fields)


def _ranges_with_holes(fields: Tokens) -> tuple[Array, int]:
    values = [_float_or_none(field) for field in fields]
    return np.array([np.nan if v is None else v for v in values]), values.count(None)


def _float_or_none(token: bytes) -> float | None:
    try:
        return float(token)
    except ValueError:
        return None


def _pose(tokens: Tokens, at: int) -> Pose:
    return plane_pose(tokens[at : at + 3])


def plane_pose(tokens: Tokens) -> Pose:
    """Return the pose x, y, theta of three fields; one that no vehicle has raises OutOfRangeError."""
    x, y, theta = (number(token, what) for token, what in zip(tokens, ("x", "y", "theta"), strict=True))
    require("coordinate", "x", x)
    require("coordinate", "y", y)
    require("angle", "theta", theta)
    return x, y, theta


def _sensor(tokens: Tokens) -> tuple[Array, int, Array, int]:
    """Return ranges, unreadable readings, remissions and the index behind them."""
    ranges, unreadable, at = parse_ranges(tokens, 8)
    count = len(ranges)
    remissions = _count(tokens, at)
    if remissions == 0:
        return ranges, unreadable, np.empty(0), at + 1
    values, _ = _ranges(tokens, at + 1, remissions)
    return ranges, unreadable, values if remissions == count else np.empty(0), at + 1 + remissions


def _config(tokens: Tokens) -> LaserConfig:
    start, fov, resolution, longest = (number(t, "the laser configuration") for t in tokens[2:6])
    return LaserConfig(start, fov, resolution, longest)
