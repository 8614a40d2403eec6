"""The MCAP container (mcap.dev/spec), as ROS 2 writes it; ROS 1 content is read as well.

File: magic, records ``u8 op, u64 length, body`` (little-endian), magic. op: 1 header, 2 footer (where the summary
begins), 3 schema, 4 channel, 5 message, 6 chunk, 11 statistics, 15 end of data. Strings are ``u32 length, bytes``.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import IO

from groma.io.containers import Channel, CutError, Raw, decompress, exactly, scan_channels

MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _STATISTICS, _DATA_END = 2, 3, 4, 5, 6, 11, 15
_FOOTER_SIZE = 9 + 20 + len(MAGIC)
_FORMATS = {"ros2msg": "msg", "ros1msg": "msg", "ros2idl": "idl", "omgidl": "idl"}
_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")


@dataclass(slots=True)
class _Known:
    """Schemas and channels met so far."""

    schemas: dict[int, tuple[str, str, str]] = field(default_factory=dict)
    """Name, definition format, definition."""
    channels: dict[int, Channel] = field(default_factory=dict)

    def take(self, op: int, body: bytes) -> None:
        """Remember a schema or a channel."""
        if op == _SCHEMA:
            reader = _Reader(body)
            key = reader.number("<H")
            name, encoding = reader.text(), reader.text()
            self.schemas[key] = (name, _FORMATS.get(encoding, encoding), reader.text())
        elif op == _CHANNEL:
            reader = _Reader(body)
            key, schema = reader.number("<H"), reader.number("<H")
            topic, encoding = reader.text(), reader.text()
            name, kind, definition = self.schemas.get(schema, ("unknown", "msg", ""))
            if name.count("/") == 1:
                name = name.replace("/", "/msg/")
            self.channels.setdefault(key, Channel(key, topic, name, encoding, definition, kind))


class Mcap:
    """One ``.mcap`` file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def channels(self) -> tuple[list[Channel], bool]:
        """Return the channels; see :class:`groma.io.containers.Container`."""
        try:
            return self._summary(), True
        except CutError:
            return scan_channels(self), False

    def messages(self, skip: Collection[int]) -> Iterator[Raw]:
        """Yield raw messages; see :class:`groma.io.containers.Container`."""
        known = _Known()
        unwanted = set(skip)
        with self.path.open("rb") as file:
            file.seek(len(MAGIC))
            for op, body in _records(file):
                if op == _CHUNK:
                    for inner, content in _records(BytesIO(_unpacked(body, str(self.path))), closed=True):
                        yield from _take(inner, content, known, unwanted)
                elif op in (_FOOTER, _DATA_END):
                    return
                else:
                    yield from _take(op, body, known, unwanted)
        raise CutError("the end of the file is missing")

    def _summary(self) -> list[Channel]:
        known = _Known()
        counts: dict[int, int] | None = None
        with self.path.open("rb") as file:
            file.seek(_summary_start(file, self.path.stat().st_size))
            for op, body in _records(file):
                if op == _FOOTER:
                    break
                if op == _STATISTICS:
                    counts = _counts(body)
                known.take(op, body)
        if counts is None or not set(counts) <= set(known.channels):
            raise CutError("no statistics in the summary")
        return [replace(channel, count=counts.get(channel.key, 0)) for channel in known.channels.values()]


class _Reader:
    """Fields of a record, one after the other."""

    def __init__(self, body: bytes) -> None:
        self._body, self._at = body, 0

    def number(self, form: str) -> int:
        try:
            (value,) = struct.unpack_from(form, self._body, self._at)
        except struct.error as error:
            raise CutError("a damaged record") from error
        self._at += struct.calcsize(form)
        return int(value)

    def pass_over(self, size: int) -> None:
        self._at += size

    def text(self) -> str:
        return self.data("<I").decode(errors="replace")

    def data(self, form: str) -> bytes:
        size = self.number(form)
        self._at += size
        if self._at > len(self._body):
            raise CutError("a damaged record")
        return self._body[self._at - size : self._at]


def _take(op: int, body: bytes, known: _Known, unwanted: set[int]) -> Iterator[Raw]:
    if op != _MESSAGE:
        known.take(op, body)
        return
    if len(body) < _MESSAGE_HEAD.size:
        raise CutError("a damaged message record")
    key, _, log_time, _ = _MESSAGE_HEAD.unpack_from(body)
    if key in unwanted:
        return
    if key not in known.channels:
        raise CutError(f"a message of channel {key}, which was not announced")
    yield known.channels[key], log_time, body[_MESSAGE_HEAD.size :]


def _records(file: IO[bytes], *, closed: bool = False) -> Iterator[tuple[int, bytes]]:
    """Yield records until the bytes end: cleanly in a chunk (closed), never in a file, whose footer comes before."""
    while True:
        head = file.read(_HEAD.size)
        if not head and closed:
            return
        if len(head) < _HEAD.size:
            raise CutError(f"the file ends at byte {file.tell()} without its footer")
        op, size = _HEAD.unpack(head)
        yield op, exactly(file, size)


def _unpacked(body: bytes, where: str) -> bytes:
    reader = _Reader(body)
    reader.pass_over(28)
    kind = reader.text()
    return decompress(kind, reader.data("<Q"), where)


def _summary_start(file: IO[bytes], size: int) -> int:
    if size < _FOOTER_SIZE + len(MAGIC):
        raise CutError("too short")
    file.seek(-_FOOTER_SIZE, os.SEEK_END)
    footer = file.read(_FOOTER_SIZE)
    op, length, start = struct.unpack_from("<BQQ", footer)
    if not footer.endswith(MAGIC) or op != _FOOTER or length != 20 or not 0 < start < size:
        raise CutError("no summary")
    return int(start)


def _counts(body: bytes) -> dict[int, int]:
    reader = _Reader(body)
    reader.pass_over(42)
    pairs = reader.data("<I")
    return dict(struct.iter_unpack("<HQ", pairs[: len(pairs) // 10 * 10]))
