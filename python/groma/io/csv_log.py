"""groma's own recording: one text file, one record a line, its tag first (docs/reference/csv.md).

    GEOMETRY,stream,angle_min,angle_increment,time_increment,range_min,range_max
    SCAN,stamp,stream,frame,n,r1,..,rn[,i1,..,in]
    ODOM,stamp,stream,frame,child_frame,x,y,theta
    JOINTS,stamp,stream,k,name1,position1,velocity1,..
    TF,stamp,stream,parent,child,static,x,y,z,qx,qy,qz,qw
    ENCODER,stream,name,counts_per_turn,modulus
    TICKS,stamp,stream,k,name1,count1,..

GEOMETRY holds for the SCAN lines of its stream until the next one. SI units, radians; ``inf`` is no return, ``nan`` is
invalid or unknown. Numbers are written so that reading gives the same bits. Lines that begin with # are remarks.
"""

from __future__ import annotations

import gzip
import io
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from typing import IO, cast

import numpy as np

from groma.errors import UserError
from groma.io.atomic import replacing
from groma.io.carmen_lines import LineError, Tokens, number, parse_ranges
from groma.io.carmen_survey import LOOKED_AT
from groma.io.csv_ticks import Encoders
from groma.io.notes import Notes
from groma.io.streams import Kind, Stream
from groma.io.text_lines import numbered_lines
from groma.nouns.bounds import OutOfRangeError
from groma.nouns.messages import BeamGeometry, JointState, LaserScan, Message, Odometry, Transform

HEADER = """\
# groma csv 1
# metres, radians, seconds; inf = no return, nan = invalid; docs/reference/csv.md
# GEOMETRY,stream,angle_min,angle_increment,time_increment,range_min,range_max
# SCAN,stamp,stream,frame,n,r1,..,rn[,i1,..,in]
# ODOM,stamp,stream,frame,child_frame,x,y,theta
# JOINTS,stamp,stream,k,name1,position1,velocity1,..
# TF,stamp,stream,parent,child,static,x,y,z,qx,qy,qz,qw
"""
TAGS = ("GEOMETRY", "SCAN", "ODOM", "JOINTS", "TF", "ENCODER", "TICKS")
_KINDS = {
    b"SCAN": Kind.SCAN,
    b"ODOM": Kind.ODOMETRY,
    b"JOINTS": Kind.JOINTS,
    b"TICKS": Kind.JOINTS,
    b"TF": Kind.TRANSFORM,
}
_STREAM_FIELD = 2


class CsvRecording:
    """One groma CSV file, plain or gzipped."""

    format = "groma CSV"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes = Notes()
        self.streams = tuple(_look(path))

    def messages(self, streams: Collection[str] | None = None) -> Iterator[Message]:
        """Yield messages in the order of the file; see :class:`groma.io.recording.Recording`."""
        self.notes.restart()
        geometries: dict[str, BeamGeometry] = {}
        encoders = Encoders()
        for line_number, line in numbered_lines(self.path, self.notes):
            fields = line.rstrip().split(b",")
            tag = fields[0].decode(errors="replace").strip()
            try:
                if tag == "GEOMETRY":
                    geometries.pop(_text(fields, 1), None)  # of a line that is refused, nothing must stand
                    geometries[_text(fields, 1)] = _geometry(fields)
                elif tag == "ENCODER":
                    encoders.announce(fields)
                elif tag in TAGS:
                    if streams is None or _text(fields, _STREAM_FIELD) in streams:
                        yield encoders.joints(fields) if tag == "TICKS" else _PARSERS[tag](fields, geometries)
                elif tag and not tag.startswith("#"):
                    self.notes.skip(tag)
            except (LineError, OutOfRangeError) as error:
                self.notes.reject(f"{self.path.name}:{line_number}", f"{tag}: {error}", error)


def write(path: Path, messages: Iterable[Message]) -> None:
    """Write a recording; gzipped when the name ends in .gz (the same messages give the same bytes).

    Parameters
    ----------
    path
        The file; replaced when the last message is written, untouched when writing fails.
    messages
        In the order in which they are to be read.

    Raises
    ------
    UserError
        When the file cannot be written, or a name has a comma or line end in it.
    """
    with replacing(path) as raw, _text_file(path, raw) as file:
        file.write(HEADER)
        geometries: dict[str, BeamGeometry] = {}
        for message in messages:
            if isinstance(message, LaserScan) and geometries.get(message.stream) != message.geometry:
                geometries[message.stream] = message.geometry
                file.write(_geometry_line(message.stream, message.geometry))
            file.write(_line(message))


def _text_file(path: Path, raw: IO[bytes]) -> IO[str]:
    binary = cast(IO[bytes], gzip.GzipFile("", "wb", fileobj=raw, mtime=0)) if path.suffix == ".gz" else raw
    return io.TextIOWrapper(binary, encoding="utf-8", newline="\n")


def _look(path: Path) -> list[Stream]:
    """Count records by stream, in a bounded look."""
    counts: Counter[tuple[str, Kind]] = Counter()
    looked, whole = 0, True
    for _, line in numbered_lines(path, Notes()):
        looked += len(line)
        if looked > LOOKED_AT:
            whole = False
            break
        fields = line.split(b",", 3)
        if fields[0] in _KINDS and len(fields) > 3:
            counts[(fields[_STREAM_FIELD].decode(errors="replace"), _KINDS[fields[0]])] += 1
    return [Stream(name, kind, count if whole else None) for (name, kind), count in counts.items()]


def _text(fields: Tokens, at: int) -> str:
    if at >= len(fields):
        raise LineError("fields are missing")
    return fields[at].decode(errors="replace").strip()


def _numbers(fields: Tokens, names: str, at: int) -> list[float]:
    """Return the fields from ``at`` on, which must be the named ones and no more."""
    wanted = names.split()
    if len(fields) != at + len(wanted):
        raise LineError(f"{len(fields)} fields, expected {at + len(wanted)}")
    return [number(field, name) for field, name in zip(fields[at:], wanted, strict=True)]


def _stamp(fields: Tokens) -> float:
    if len(fields) < 4:
        raise LineError("fields are missing")
    return number(fields[1], "stamp")


def _geometry(fields: Tokens) -> BeamGeometry:
    return BeamGeometry(*_numbers(fields, "angle_min angle_increment time_increment range_min range_max", 2))


def _scan(fields: Tokens, geometries: dict[str, BeamGeometry]) -> LaserScan:
    stream = _text(fields, 2)
    if stream not in geometries:
        raise LineError(f"no GEOMETRY line for {stream!r} before it")
    ranges, _, end = parse_ranges(fields, 4)
    rest = len(fields) - end
    if rest not in (0, len(ranges)):
        raise LineError(f"{rest} fields after the {len(ranges)} readings, expected none or as many intensities")
    intensities = np.array([number(field, "intensity") for field in fields[end:]])
    return LaserScan(_stamp(fields), stream, _text(fields, 3), geometries[stream], ranges, intensities)


def _odometry(fields: Tokens, _: dict[str, BeamGeometry]) -> Odometry:
    x, y, theta = _numbers(fields, "x y theta", 5)
    return Odometry(_stamp(fields), _text(fields, 2), x, y, theta, _text(fields, 3), _text(fields, 4))


def _joints(fields: Tokens, _: dict[str, BeamGeometry]) -> JointState:
    count = number(_text(fields, 3).encode(), "the number of joints")
    if count != (len(fields) - 4) / 3:
        raise LineError(f"announces {count:g} joints and has {len(fields) - 4} fields for them")
    names = tuple(_text(fields, at) for at in range(4, len(fields), 3))
    positions, velocities = (
        np.array([number(fields[at], what) for at in range(first, len(fields), 3)])
        for first, what in ((5, "position"), (6, "velocity"))
    )
    return JointState(_stamp(fields), _text(fields, 2), names, positions, velocities)


def _transform(fields: Tokens, _: dict[str, BeamGeometry]) -> Transform:
    x, y, z, qx, qy, qz, qw = _numbers(fields, "x y z qx qy qz qw", 6)
    static = _text(fields, 5) == "1"
    parent, child = _text(fields, 3), _text(fields, 4)
    return Transform(_stamp(fields), _text(fields, 2), parent, child, (x, y, z), (qx, qy, qz, qw), static=static)


_PARSERS: dict[str, Callable[[Tokens, dict[str, BeamGeometry]], Message]] = {
    "SCAN": _scan,
    "ODOM": _odometry,
    "JOINTS": _joints,
    "TF": _transform,
}


def _geometry_line(stream: str, g: BeamGeometry) -> str:
    fields = (g.angle_min, g.angle_increment, g.time_increment, g.range_min, g.range_max)
    return f"GEOMETRY,{_name(stream)},{_joined(fields)}\n"


def _line(message: Message) -> str:
    start = f"{float(message.stamp)!r},{_name(message.stream)}"
    if isinstance(message, LaserScan):
        readings = _joined([*message.ranges.tolist(), *message.intensities.tolist()])
        return f"SCAN,{start},{_name(message.frame)},{len(message.ranges)},{readings}\n"
    if isinstance(message, Odometry):
        frames = f"{_name(message.frame)},{_name(message.child_frame)}"
        return f"ODOM,{start},{frames},{_joined((message.x, message.y, message.theta))}\n"
    if isinstance(message, JointState):
        joints = zip(message.names, message.positions.tolist(), message.velocities.tolist(), strict=True)
        told = "".join(f",{_name(name)},{position!r},{velocity!r}" for name, position, velocity in joints)
        return f"JOINTS,{start},{len(message.names)}{told}\n"
    frames = f"{_name(message.parent)},{_name(message.child)},{int(message.static)}"
    return f"TF,{start},{frames},{_joined((*message.translation, *message.quaternion))}\n"


def _joined(values: Iterable[float]) -> str:
    return ",".join([repr(float(value)) for value in values])


def _name(text: str) -> str:
    if any(mark in text for mark in ",\r\n"):
        raise UserError(f"the name {text!r} cannot stand in a CSV recording: it has a comma or a line end in it")
    return text
