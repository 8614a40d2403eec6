"""DP-SLAM logs: ``Odometry x y theta`` and ``Laser n r1 .. rn`` lines in turn, metres and radians, no times.

Scans get the times 0, 1, 2, ... seconds; an Odometry line belongs to the scan that follows it. Beam geometry and
no-return value: ``beams.py``. The mounting is not in the format. Source: the logs that come with DP-SLAM (OpenSLAM).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from pathlib import Path

from groma.io import beams
from groma.io.carmen_lines import LineError, Tokens, parse_ranges, plane_pose
from groma.io.carmen_survey import LOOKED_AT, SYNTHETIC_PERIOD
from groma.io.notes import Notes
from groma.io.sampling import Sample
from groma.io.streams import Kind, Stream
from groma.io.text_lines import numbered_lines
from groma.nouns.arrays import Array
from groma.nouns.bounds import OutOfRangeError
from groma.nouns.messages import LaserScan, Message, Odometry
from groma.nouns.poses import Pose

TAGS = ("Odometry", "Laser")


class DpSlamRecording:
    """One DP-SLAM log."""

    format = "DP-SLAM log"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes = Notes()
        self._no_return, counts, whole = _look(path)
        kinds = {"Laser": Kind.SCAN, "Odometry": Kind.ODOMETRY}
        self.streams = tuple(Stream(tag, kinds[tag], n if whole else None) for tag, n in counts.items() if n)
        self.notes.assume(f"no times: scans are put {SYNTHETIC_PERIOD:g} s apart")
        self.notes.assume("mounting of the laser unknown: the format has none", "mount-unknown")

    def messages(self, streams: Collection[str] | None = None) -> Iterator[Message]:
        """Yield messages in the order of the file; see :class:`groma.io.recording.Recording`."""
        self.notes.restart()
        scans = 0
        for line_number, line in numbered_lines(self.path, self.notes):
            tokens = line.split()
            if not tokens or tokens[0].startswith(b"#"):
                continue
            tag = tokens[0].decode(errors="replace")
            try:
                if tag not in TAGS:
                    self.notes.skip(tag)
                elif streams is None or tag in streams:
                    stamp = scans * SYNTHETIC_PERIOD
                    yield Odometry(stamp, tag, *_pose(tokens)) if tag == "Odometry" else self._scan(stamp, tokens)
            except (LineError, OutOfRangeError) as error:
                self.notes.reject(f"{self.path.name}:{line_number}", f"{tag}: {error}", error)
            scans += tag == "Laser"

    def _scan(self, stamp: float, tokens: Tokens) -> LaserScan:
        ranges = _ranges(tokens, self.notes)
        geometry = beams.geometry(len(ranges), self._no_return or beams.LONGEST_KNOWN)
        self._assume_geometry(len(ranges), geometry.angle_min, geometry.angle_increment)
        ranges = beams.normalise(ranges, geometry.range_min, geometry.range_max, self.notes)
        return LaserScan(stamp, "Laser", "laser", geometry, ranges)

    def _assume_geometry(self, count: int, first: float, step: float) -> None:
        known = self._no_return is not None
        found = (
            f"{self._no_return:g} m and more, from the data" if known else f"unknown; {beams.LONGEST_KNOWN:g} m taken"
        )
        self.notes.assume(
            f"Laser: {count} beams, first {math.degrees(first):.4g} deg, step {math.degrees(step):.4g} deg "
            "(from the number of beams; the line has no geometry)"
        )
        self.notes.assume(f"Laser: no return is {found}")


def _pose(tokens: Tokens) -> Pose:
    if len(tokens) != 4:
        raise LineError(f"{len(tokens) - 1} fields, expected 3")
    return plane_pose(tokens[1:])


def _ranges(tokens: Tokens, notes: Notes) -> Array:
    ranges, unreadable, end = parse_ranges(tokens, 1)
    if end != len(tokens):
        raise LineError(f"announces {len(ranges)} readings and has {len(tokens) - 2}")
    if unreadable:
        notes.beams["unreadable"] += unreadable
    return ranges


def _look(path: Path) -> tuple[float | None, dict[str, int], bool]:
    """Return the no-return value, the lines by tag and whether that is all of them."""
    sample: Sample[tuple[Array, tuple[float, float]]] = Sample()
    counts = dict.fromkeys(TAGS, 0)
    place = (0.0, 0.0)
    looked = 0
    for _, line in numbered_lines(path, Notes()):
        looked += len(line)
        if looked > LOOKED_AT:
            return _infer(sample), counts, False
        tokens = line.split()
        tag = tokens[0].decode(errors="replace") if tokens else ""
        if tag not in TAGS:
            continue
        counts[tag] += 1
        try:
            if tag == "Odometry":
                place = _pose(tokens)[:2]
            else:
                sample.offer((parse_ranges(tokens, 1)[0], place))
        except (LineError, OutOfRangeError):
            continue
    return _infer(sample), counts, True


def _infer(sample: Sample[tuple[Array, tuple[float, float]]]) -> float | None:
    return beams.infer_no_return([ranges for ranges, _ in sample.kept], [place for _, place in sample.kept])
