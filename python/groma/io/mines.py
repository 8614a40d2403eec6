"""Logs of the MINES ParisTech rover (the test files of tinySLAM, OpenSLAM): numbers in columns, one scan a line.

    time [us]  -  q1  q2  ..  682 ranges [mm] after 25 columns

A Hokuyo URG-04LX, 360/1024 degrees a beam, ten scans a second; readings below 20 are codes for "nothing" (0) and
errors. ``q1`` and ``q2`` count the left and right wheel, 2000 to a turn; they are reported in radians. The log does
not say where the laser sits.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np

from groma.io.carmen_lines import LineError, number
from groma.io.counters import Counter
from groma.io.notes import Notes
from groma.io.streams import Kind, Stream
from groma.io.text_lines import numbered_lines
from groma.nouns.bounds import OutOfRangeError, require
from groma.nouns.messages import BeamGeometry, JointState, LaserScan, Message

BEAMS, BEFORE = 682, 25
HEAD = re.compile(rb"\A(-?[\d.]+[ \t]+){%d}" % (BEFORE + BEAMS - 1))
SCAN, JOINTS = "scan", "wheels"
NAMES = ("left_wheel", "right_wheel")
COUNTS = 2000
OVERFLOW = 2.0**32
_STEP = 2 * math.pi / 1024
GEOMETRY = BeamGeometry(-_STEP * (BEAMS - 1) / 2, _STEP, 0.1 / 1024, 0.02, 5.6)
_CODES = 20.0


class MinesRecording:
    """One log of the rover."""

    format = "MINES rover log"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes = Notes()
        count = sum(1 for _ in numbered_lines(path, Notes()))
        self.streams = (Stream(SCAN, Kind.SCAN, count), Stream(JOINTS, Kind.JOINTS, count))
        self.notes.assume(
            "a Hokuyo URG-04LX of 682 beams, and 2000 counts to a turn of a wheel: the format has neither"
        )

    def messages(self, streams: Collection[str] | None = None) -> Iterator[Message]:
        """Yield messages in the order of the file; see :class:`groma.io.recording.Recording`."""
        self.notes.restart()
        counters = (Counter(OVERFLOW), Counter(OVERFLOW))
        for line_number, line in numbered_lines(self.path, self.notes):
            fields = line.split()
            if not fields:
                continue
            try:
                joints, scan = self._messages(fields, counters)
            except (LineError, OutOfRangeError) as error:
                self.notes.reject(f"{self.path.name}:{line_number}", str(error), error)
                continue
            if streams is None or JOINTS in streams:
                yield joints
            if streams is None or SCAN in streams:
                yield scan

    def _messages(self, fields: list[bytes], counters: Sequence[Counter]) -> tuple[JointState, LaserScan]:
        if len(fields) != BEFORE + BEAMS:
            raise LineError(f"{len(fields)} columns, expected {BEFORE + BEAMS}")
        stamp = number(fields[0], "time") * 1e-6
        require("stamp", "time", stamp)
        counts = [counter.read(number(field, "count")) for counter, field in zip(counters, fields[2:4], strict=True)]
        ranges = np.array([number(field, "range") for field in fields[BEFORE:]])
        positions = np.array(counts) * (2 * math.pi / COUNTS)
        joints = JointState(stamp, JOINTS, NAMES, positions, np.full(2, np.nan))
        return joints, LaserScan(stamp, SCAN, "laser", GEOMETRY, self._metres(ranges))

    def _metres(self, ranges: np.ndarray) -> np.ndarray:
        codes = ranges < _CODES
        metres = ranges * 1e-3
        metres[codes] = np.nan
        metres[ranges == 0] = np.inf
        self.notes.beams["error codes"] += int(codes.sum() - (ranges == 0).sum())
        return metres
