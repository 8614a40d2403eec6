"""CARMEN logs (.log, .clf, .gfs, plain or .gz): scans, odometry and, from their two poses, the mounting of the laser.

A line with robot pose gives an :class:`Odometry` and a :class:`LaserScan` of the same stamp and stream (its tag), and
once for each laser the static transform ``base_link -> laser``. ``ODOM`` lines are a stream of their own: in logs
that went through a mapping program they repeat times with other poses, so the two must not be mixed.
Line grammar: ``carmen_lines.py``; what lines leave open: ``carmen_survey.py``, ``beams.py``. ``PARAM``
``laser_front_laser_resolution`` [deg] wins over the beam table. ``robot_front_laser_max`` is how far CARMEN's planner
looks, not how far the scanner sees, so it is not used. Lines of other tools are skipped and counted by tag.

Not read: SYNC, TRUEPOS, LASER3, LASER4 and sonar lines (counted as skipped).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

from groma.io import beams
from groma.io.carmen_lines import LaserConfig, LineError, ScanLine, Tokens, number, parse_odom
from groma.io.carmen_survey import SCAN_PARSERS, SYNTHETIC_PERIOD, Survey, differ, mount_of, survey
from groma.io.notes import Notes
from groma.io.streams import Kind, Stream
from groma.io.text_lines import numbered_lines
from groma.nouns.bounds import OutOfRangeError, is_within
from groma.nouns.messages import BeamGeometry, LaserScan, Message, Odometry, Transform
from groma.nouns.poses import Pose, quaternion_of

TAGS = (*(tag.decode() for tag in SCAN_PARSERS), "ODOM", "PARAM", "SYNC", "TRUEPOS", "LASER3", "LASER4")
_PRINT_QUANTUM = 1e-6
_FINEST_STEP = math.radians(0.125)


class CarmenRecording:
    """One CARMEN log."""

    format = "CARMEN log"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes = Notes()
        self._survey = survey(path)
        self.streams = tuple(_streams(self._survey))
        self._no_return = {tag: traits.no_return for tag, traits in self._survey.scans.items()}
        self._geometries: dict[tuple[str, int, LaserConfig | None], BeamGeometry] = {}
        self._assume_clock()
        for tag, traits in self._survey.scans.items():
            if traits.mount is None and not tag.startswith("RAW"):
                self.notes.assume(f"{tag}: mounting of the laser unknown: {traits.why_no_mount}", "mount-unknown")
        self._compare_offset()

    def messages(self, streams: Collection[str] | None = None) -> Iterator[Message]:
        """Yield messages in the order of the file; see :class:`groma.io.recording.Recording`."""
        self.notes.restart()
        scans_seen: Counter[str] = Counter()
        mounts: dict[str, Pose] = {}
        for line_number, line in numbered_lines(self.path, self.notes):
            tokens = line.split()
            if not tokens or tokens[0].startswith(b"#"):
                continue
            tag = tokens[0].decode(errors="replace")
            wanted = streams is None or tag in streams
            try:
                if tokens[0] in SCAN_PARSERS:
                    if wanted:
                        yield from self._scan(tag, tokens, scans_seen[tag], mounts)
                    scans_seen[tag] += 1
                elif tag == "ODOM":
                    if wanted:
                        yield self._odom(tokens, max(scans_seen.values(), default=0))
                elif tag != "PARAM":
                    self.notes.skip(tag)
            except (LineError, OutOfRangeError) as error:
                self.notes.reject(f"{self.path.name}:{line_number}", f"{tag}: {error}", error)

    def _scan(self, tag: str, tokens: Tokens, index: int, mounts: dict[str, Pose]) -> Iterator[Message]:
        line = SCAN_PARSERS[tokens[0]](tokens)
        stamp = self._stamp(tag, line.stamps, index)
        frame = frame_of(tag)
        if line.laser and line.robot and self._survey.scans[tag].mount is not None:
            mount = mount_of(line.laser, line.robot)
            if frame not in mounts or differ(mount, mounts[frame]):
                mounts[frame] = mount
                yield _transform(stamp, tag, frame, mount)
        if line.robot:
            yield Odometry(stamp, tag, *line.robot)
        if line.unreadable:
            self.notes.beams["unreadable"] += line.unreadable
        geometry = self._geometry(tag, line)
        ranges = beams.normalise(line.ranges, geometry.range_min, geometry.range_max, self.notes)
        yield LaserScan(stamp, tag, frame, geometry, ranges, line.remissions)

    def _odom(self, tokens: Tokens, scans_before: int) -> Odometry:
        pose, stamps = parse_odom(tokens)
        return Odometry(self._stamp("ODOM", stamps, scans_before), "ODOM", *pose)

    def _stamp(self, tag: str, stamps: Tokens, index: int) -> float:
        clock = self._survey.clock
        usual = self._survey.stamp_fields.get(tag, len(stamps))
        if len(stamps) != usual or (clock != "none" and usual < (2 if clock == "ipc" else 3)):
            raise LineError(f"{len(stamps)} fields for the time at its end, not as the other lines")
        if clock == "none":
            return index * SYNTHETIC_PERIOD
        if clock == "seconds and microseconds":
            return number(stamps[0], "seconds") + 1e-6 * number(stamps[2], "microseconds")
        stamp = number(stamps[0 if clock == "ipc" else 2], "time")
        if not math.isfinite(stamp):
            raise LineError(f"time {stamp} is not finite")
        return stamp

    def _geometry(self, tag: str, line: ScanLine) -> BeamGeometry:
        key = (tag, len(line.ranges), line.config)
        if key not in self._geometries:
            made = self._configured(tag, line) if line.config else self._assumed(tag, len(line.ranges))
            self._geometries[key] = made
        return self._geometries[key]

    def _configured(self, tag: str, line: ScanLine) -> BeamGeometry:
        config, count = line.config, len(line.ranges)
        assert config is not None  # noqa: S101 (told by the caller)
        step = config.resolution or config.fov / max(count - 1, 1)
        makes_sense = is_within("angle_step", abs(step)) and is_within("angle_min", config.start)
        if not (makes_sense and abs(step) * count < 2.01 * math.pi):
            self.notes.assume(f"{tag}: the beam geometry on the line makes no sense; taken from the number of beams")
            return self._assumed(tag, count)
        believed = config.range_max > beams.RANGE_MIN and is_within("range", config.range_max)
        longest = config.range_max if believed else beams.LONGEST_KNOWN
        inferred = self._no_return.get(tag)
        if inferred is not None and inferred < longest:
            self.notes.assume(
                f"{tag}: no return is {inferred:g} m and more, from the data (the line says {longest:g} m)"
            )
            longest = inferred
        return BeamGeometry(_snap(config.start), _snap(step), 0.0, beams.RANGE_MIN, longest)

    def _assumed(self, tag: str, count: int) -> BeamGeometry:
        step = self._resolution(count) if tag == "FLASER" else None
        inferred = self._no_return.get(tag)
        geometry = beams.geometry(count, inferred or beams.LONGEST_KNOWN, step)
        source = "PARAM laser_front_laser_resolution" if step else "the number of beams"
        self.notes.assume(
            f"{tag}: {count} beams, first {math.degrees(geometry.angle_min):.4g} deg, "
            f"step {math.degrees(geometry.angle_increment):.4g} deg (from {source}; the line has no geometry)"
        )
        found = f"{inferred:g} m and more, from the data" if inferred else f"unknown; {beams.LONGEST_KNOWN:g} m taken"
        self.notes.assume(f"{tag}: no return is {found}")
        return geometry

    def _resolution(self, count: int) -> float | None:
        text = self._survey.parameters.get("laser_front_laser_resolution")
        if text is None:
            return None
        try:
            step = math.radians(float(text))
        except ValueError:
            step = math.nan
        if 0 < step * (count - 1) <= 2.01 * math.pi:
            return step
        self.notes.assume(f"PARAM laser_front_laser_resolution {text} does not fit {count} beams; not used")
        return None

    def _assume_clock(self) -> None:
        clock = self._survey.clock
        if clock == "none":
            self.notes.assume(f"no usable times: scans are put {SYNTHETIC_PERIOD:g} s apart")
        elif clock == "logger":
            self.notes.assume("ipc times are unusable (equal or missing): logger times taken")

    def _compare_offset(self) -> None:
        text = self._survey.parameters.get("robot_frontlaser_offset", "0")
        traits = self._survey.scans.get("FLASER")
        try:
            offset = float(text)
        except ValueError:
            return
        if traits and traits.mount and abs(offset - traits.mount[0]) > 0.01:
            self.notes.assume(
                f"PARAM robot_frontlaser_offset says {offset:g} m, the poses on FLASER lines say "
                f"{traits.mount[0]:.3g} m; the poses are taken"
            )


def frame_of(tag: str) -> str:
    """Return the laser frame of a scan tag; front and rear scanner have one each, whatever tag they are logged with."""
    if tag in ("FLASER", "RAWLASER1", "ROBOTLASER1"):
        return "laser"
    if tag in ("RLASER", "RAWLASER2", "ROBOTLASER2"):
        return "laser_rear"
    return f"laser{tag[-1]}"


def _streams(found: Survey) -> Iterator[Stream]:
    for tag, count in found.counts.items():
        known = count if found.whole else None
        if tag in found.scans:
            yield Stream(tag, Kind.SCAN, known)
            if not tag.startswith("RAW"):
                yield Stream(tag, Kind.ODOMETRY, known)
        elif tag == "ODOM":
            yield Stream(tag, Kind.ODOMETRY, known)


def _snap(angle: float) -> float:
    """Return the multiple of 1/8 deg that was printed with six decimals, or the angle itself."""
    multiple = round(angle / _FINEST_STEP) * _FINEST_STEP
    return multiple if abs(multiple - angle) < _PRINT_QUANTUM else angle


def _transform(stamp: float, stream: str, frame: str, mount: Pose) -> Transform:
    at, turn = (mount[0], mount[1], 0.0), quaternion_of(mount[2])
    return Transform(stamp, stream, "base_link", frame, at, turn, static=True)
