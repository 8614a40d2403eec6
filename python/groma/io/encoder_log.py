"""Logs of a steered vehicle with a tracked sensor, as used by courses on calibration.

    #kinematic_model: traction_drive_wheel
    #joints_max_enc: [ steering traction_wheel ]
    #joints_max_enc_values: 8192 5000
    time: 1668091584.821 ticks: 290 4294859756 model_pose: 0 0 0 tracker_pose: 0.1 -0.2 0.03

The steering encoder is absolute (``max`` counts a turn, read as -pi .. pi), the traction encoder a 32-bit counter of
``max`` counts a turn of its own shaft. Joints are reported in radians; poses are those of the vehicle by the program
that wrote the log, and of the sensor in the frame of the tracker.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from groma.io.carmen_lines import LineError, number
from groma.io.counters import Counter, shorter_way
from groma.io.notes import Notes
from groma.io.streams import Kind, Stream
from groma.io.text_lines import numbered_lines
from groma.nouns.bounds import OutOfRangeError, require, require_all
from groma.nouns.messages import JointState, Message, Odometry

HEAD = re.compile(rb"\A(#[^\n]*\n)*#? ?kinematic_model")
JOINTS, MODEL, TRACKER = "joints", "model_pose", "tracker_pose"
NAMES = ("traction_wheel", "steering")
OVERFLOW = 2.0**32
_FIELDS = 13
_KNOWN_COUNTS = (8192.0, 5000.0)


class EncoderLogRecording:
    """One log of encoder counts."""

    format = "encoder log"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes = Notes()
        count = sum(line.startswith(b"time:") for _, line in numbered_lines(path, Notes()))
        kinds = ((JOINTS, Kind.JOINTS), (MODEL, Kind.ODOMETRY), (TRACKER, Kind.ODOMETRY))
        self.streams = tuple(Stream(name, kind, count) for name, kind in kinds)

    def messages(self, streams: Collection[str] | None = None) -> Iterator[Message]:
        """Yield messages in the order of the file; see :class:`groma.io.recording.Recording`."""
        self.notes.restart()
        counts, traction = _KNOWN_COUNTS, Counter(OVERFLOW)
        for line_number, line in numbered_lines(self.path, self.notes):
            try:
                if line.startswith(b"#joints_max_enc_values:"):
                    counts = _counts(line)
                elif line.startswith(b"time:"):
                    for message in _messages(line, counts, traction):
                        if streams is None or message.stream in streams:
                            yield message
                elif line.strip() and not line.startswith(b"#"):
                    self.notes.skip(line.split()[0].decode(errors="replace")[:20])
            except (LineError, OutOfRangeError) as error:
                self.notes.reject(f"{self.path.name}:{line_number}", str(error), error)


def _counts(line: bytes) -> tuple[float, float]:
    fields = line.split()[1:]
    if len(fields) != 2:
        raise LineError(f"{len(fields)} counts per turn, expected 2")
    steering, traction = (number(field, "counts per turn") for field in fields)
    for counts in (steering, traction):
        require("per_turn", "counts per turn", counts)
    return steering, traction


def _messages(line: bytes, counts: tuple[float, float], traction: Counter) -> list[Message]:
    fields = line.split()
    if len(fields) != _FIELDS or (fields[2], fields[5], fields[9]) != (b"ticks:", b"model_pose:", b"tracker_pose:"):
        raise LineError("expected time: t ticks: s d model_pose: x y theta tracker_pose: x y theta")
    values = [number(fields[k], "a field") for k in (1, 3, 4, 6, 7, 8, 10, 11, 12)]
    require_all("joint", "field", values)
    stamp, steering, ticks, x, y, theta, *tracked = values
    turn = 2 * math.pi
    positions = np.array([traction.read(ticks) * turn / counts[1], shorter_way(steering, counts[0]) * turn / counts[0]])
    return [
        JointState(stamp, JOINTS, NAMES, positions, np.full(2, np.nan)),
        Odometry(stamp, MODEL, x, y, theta, "odom", "base_link"),
        Odometry(stamp, TRACKER, tracked[0], tracked[1], tracked[2], "tracker", "sensor"),
    ]
