"""Synchronised tuples of a differential drive with a laser: one JSON object a line (Censi et al., TRO 29, 2013).

    { "T": 0.7965, "phi_l": 0.0827, "phi_r": 0.0542, "sm": [ -0.0008, -0.0002, -0.0004 ] }

In ``T`` seconds the wheels turned at ``phi_l`` and ``phi_r`` [rad/s] while scan matching saw the laser move by ``sm``
(x, y [m], theta [rad]). Intervals are put one after the other: wheel angles at their ends, and the poses of the laser
that the motions add up to.
Other keys are passed over.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from groma import _core
from groma.io.carmen_lines import LineError
from groma.io.notes import Notes
from groma.io.streams import Kind, Stream
from groma.io.text_lines import numbered_lines
from groma.nouns.arrays import Array
from groma.nouns.bounds import OutOfRangeError, require_all
from groma.nouns.messages import JointState, Message, Odometry
from groma.nouns.poses import Pose

HEAD = re.compile(rb'\A\s*\{[^\n]*"phi_l"')
JOINTS, POSES = "wheels", "laser_poses"
NAMES = ("left_wheel", "right_wheel")


class TupleRecording:
    """One file of tuples."""

    format = "motion tuples"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes = Notes()
        count = sum(line.count(b'"T"') for _, line in numbered_lines(path, Notes()))
        self.streams = (Stream(JOINTS, Kind.JOINTS, count + 1), Stream(POSES, Kind.ODOMETRY, count + 1))

    def messages(self, streams: Collection[str] | None = None) -> Iterator[Message]:
        """Yield messages in the order of the file; see :class:`groma.io.recording.Recording`."""
        self.notes.restart()
        time, wheels, pose = 0.0, np.zeros(2), (0.0, 0.0, 0.0)
        yield from _at(time, wheels, pose, streams)
        for line_number, line in numbered_lines(self.path, self.notes):
            try:
                for interval, rates, motion in _tuples(line):
                    time, wheels, pose = time + interval, wheels + interval * rates, _core.composed(pose, motion)
                    yield from _at(time, wheels, pose, streams)
            except (LineError, OutOfRangeError) as error:
                self.notes.reject(f"{self.path.name}:{line_number}", str(error), error)


def _at(time: float, wheels: Array, pose: Pose, streams: Collection[str] | None) -> Iterator[Message]:
    if streams is None or JOINTS in streams:
        yield JointState(time, JOINTS, NAMES, wheels, np.full(2, np.nan))
    if streams is None or POSES in streams:
        yield Odometry(time, POSES, *pose, "start", "laser")


def _tuples(line: bytes) -> Iterator[tuple[float, Array, Pose]]:
    """Yield the tuples of a line: one, or several where line ends were lost."""
    text = line.decode(errors="replace").strip()
    while text:
        try:
            read, end = json.JSONDecoder().raw_decode(text)
        except ValueError as error:
            raise LineError(f"no JSON object ({error})") from error
        yield _tuple(read)
        text = text[end:].strip()


def _tuple(read: object) -> tuple[float, Array, Pose]:
    try:
        numbers = [float(read[key]) for key in ("T", "phi_l", "phi_r")]  # type: ignore[index]
        numbers += [float(value) for value in read["sm"]]  # type: ignore[index]
    except (ValueError, KeyError, TypeError) as error:
        raise LineError(f"no tuple of T, phi_l, phi_r and sm ({error})") from error
    if len(numbers) != 6 or numbers[0] <= 0:
        raise LineError("T must be above 0, sm three numbers")
    require_all("motion", "tuple", numbers)
    return numbers[0], np.array(numbers[1:3]), (numbers[3], numbers[4], numbers[5])
