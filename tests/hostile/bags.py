"""ROS bags with one number of one message replaced."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from made import Entry, Ros, bag1, bag2, drive_entries
from rosbags.rosbag2 import StoragePlugin

FLOATS = (float("nan"), float("inf"), float("-inf"), 1e300, -1e300, 0.0, -1.0)
WHOLE = (-(2**31), 2**31 - 1, 0, -1)
TOPICS = ("/tf_static", "/odom", "/scan", "/joint_states")
UNREAD = ("covariance", "twist", "seq", "angle_max", "scan_time")
"""Fields that groma does not read, or only to tell."""


@dataclass(frozen=True)
class Change:
    """A field of the middle message of a topic, replaced."""

    topic: str
    path: tuple[str | int, ...]
    value: float

    @property
    def name(self) -> str:
        """Where and what."""
        return f"{self.topic} {'.'.join(map(str, self.path))} = {self.value:g}"


def fields(value: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    """Yield the path and the value of every number in a message; of an array the first and the middle one."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name not in UNREAD:
                yield from fields(getattr(value, field.name), (*path, field.name))
    elif isinstance(value, list | np.ndarray):
        for k in sorted({0, len(value) // 2} if len(value) else ()):
            yield from fields(value[k], (*path, k))
    elif isinstance(value, int | float | np.number):
        yield path, value


def replaced(value: Any, path: tuple[str | int, ...], new: float) -> Any:
    """Return a message with one number replaced."""
    if not path:
        return np.array(new, dtype=value.dtype)[()] if isinstance(value, np.number) else new
    key, rest = path[0], path[1:]
    if isinstance(key, str):
        return dataclasses.replace(value, **{key: replaced(getattr(value, key), rest, new)})
    copy = value.copy()
    copy[key] = replaced(value[key], rest, new)
    return copy


def changes() -> Iterator[Change]:
    """Yield every change."""
    entries = drive_entries(Ros(2))
    for topic in TOPICS:
        message = middle(entries, topic)[1]
        for path, value in fields(message):
            for new in WHOLE if isinstance(value, int) else FLOATS:
                yield Change(topic, path, new)


def middle(entries: list[Entry], topic: str) -> tuple[int, Any]:
    """Return the place and the message of the middle entry of a topic."""
    places = [k for k, entry in enumerate(entries) if entry[0] == topic]
    place = places[len(places) // 2]
    return place, entries[place][2][1]


def changed(ros: Ros, change: Change) -> list[Entry]:
    """Return a drive with one number replaced."""
    entries = drive_entries(ros)
    place, message = middle(entries, change.topic)
    topic, time, (kind, _) = entries[place]
    entries[place] = (topic, time, (kind, replaced(message, change.path, change.value)))
    return entries


@dataclass(frozen=True)
class Bag:
    """A kind of bag and the command that reads it."""

    name: str
    command: tuple[str, ...]
    version: int
    make: Callable[[Path, list[Entry]], Path]

    def write(self, folder: Path, change: Change) -> Path | None:
        """Write the changed bag; nothing where the field cannot hold the value."""
        try:
            return self.make(folder, changed(Ros(self.version), change))
        except (OverflowError, struct.error, FloatingPointError):
            return None


KINDS = (
    Bag("ROS 1 bag", ("map", "-o", "out"), 1, lambda folder, entries: bag1(folder / "drive.bag", entries)),
    Bag("MCAP", ("map", "-o", "out"), 2, lambda f, entries: bag2(f / "mcap", entries, StoragePlugin.MCAP)),
    Bag("sqlite3", ("map", "-o", "out"), 2, lambda f, entries: bag2(f / "db3", entries, StoragePlugin.SQLITE3)),
    Bag("MCAP, inspected", ("inspect",), 2, lambda f, entries: bag2(f / "mcap", entries, StoragePlugin.MCAP)),
)
