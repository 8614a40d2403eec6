"""The ROS 1 bag container, version 2.0 (wiki.ros.org/Bags/Format/2.0).

File: the line ``#ROSBAG V2.0``, then records ``u32 header_length, header, u32 data_length, data`` (little-endian); a
header is a list of ``u32 length, name=value``. op: 2 message, 3 bag header (index_pos), 4 index, 5 chunk, 6 chunk info
(messages per connection), 7 connection. Chunks hold message and connection records.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import IO

from groma.errors import UserError
from groma.io.containers import Channel, CutError, Raw, decompress, exactly, scan_channels

MAGIC = b"#ROSBAG V"
_MESSAGE, _BAG_HEADER, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 3, 5, 6, 7
_U32 = struct.Struct("<I")
_PAIR = struct.Struct("<II")
Fields = dict[bytes, bytes]


class Bag1:
    """One ``.bag`` file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with path.open("rb") as file:
            version = file.readline(32).strip()
        if version != MAGIC + b"2.0":
            raise UserError(
                f"{path}: a ROS 1 bag of version {version[9:].decode(errors='replace')!r}; groma reads 2.0: "
                "run `rosbag fix` or `rosbag migrate` on it"
            )

    def channels(self) -> tuple[list[Channel], bool]:
        """Return the channels; see :class:`groma.io.containers.Container`."""
        try:
            return self._indexed(), True
        except CutError:
            return scan_channels(self), False

    def messages(self, skip: Collection[int]) -> Iterator[Raw]:
        """Yield raw messages; see :class:`groma.io.containers.Container`."""
        known: dict[int, Channel] = {}
        unwanted = set(skip)
        with self.path.open("rb") as file:
            file.readline(32)
            while (record := _record(file)) is not None:
                fields, data = record
                op = _op(fields)
                if op == _CHUNK:
                    kind = fields.get(b"compression", b"none").decode(errors="replace")
                    yield from _inside(BytesIO(decompress(kind, data, str(self.path))), known, unwanted)
                elif op in (_CONNECTION, _MESSAGE):
                    yield from _take(fields, data, known, unwanted)

    def _indexed(self) -> list[Channel]:
        counts: Counter[int] = Counter()
        known: dict[int, Channel] = {}
        with self.path.open("rb") as file:
            file.readline(32)
            first = _record(file)
            if first is None or _op(first[0]) != _BAG_HEADER:
                raise CutError("no bag header")
            if b"encryptor" in first[0] and first[0][b"encryptor"]:
                raise UserError(f"{self.path}: the bag is encrypted")
            (index,) = struct.unpack("<Q", first[0].get(b"index_pos", bytes(8))[:8].ljust(8, b"\0"))
            if index == 0 or index > self.path.stat().st_size:
                raise CutError("no index")
            file.seek(index)
            while (record := _record(file)) is not None:
                _count(*record, known, counts)
        return [replace(channel, count=counts[channel.key]) for channel in known.values()]


def _count(fields: Fields, data: bytes, known: dict[int, Channel], counts: Counter[int]) -> None:
    if _op(fields) == _CONNECTION:
        channel = _channel(fields, data)
        known[channel.key] = channel
    elif _op(fields) == _CHUNK_INFO:
        for connection, count in _PAIR.iter_unpack(data[: len(data) // 8 * 8]):
            counts[connection] += count


def _inside(chunk: BytesIO, known: dict[int, Channel], unwanted: set[int]) -> Iterator[Raw]:
    while (record := _record(chunk)) is not None:
        yield from _take(*record, known, unwanted)


def _take(fields: Fields, data: bytes, known: dict[int, Channel], unwanted: set[int]) -> Iterator[Raw]:
    op = _op(fields)
    if op == _CONNECTION:
        channel = _channel(fields, data)
        known.setdefault(channel.key, channel)
    elif op == _MESSAGE:
        key = _unsigned(fields, b"conn")
        if key not in known:
            raise CutError(f"a message of connection {key}, which was not announced")
        if key not in unwanted:
            seconds, nanoseconds = _PAIR.unpack(fields.get(b"time", b"")[:8].ljust(8, b"\0"))
            yield known[key], seconds * 1_000_000_000 + nanoseconds, data


def _record(file: IO[bytes]) -> tuple[Fields, bytes] | None:
    """Return the next record, None at a clean end."""
    start = file.read(4)
    if not start:
        return None
    if len(start) < 4:
        raise CutError(f"the file ends in the middle of a record at byte {file.tell()}")
    fields = _fields(exactly(file, _U32.unpack(start)[0]))
    return fields, exactly(file, _U32.unpack(exactly(file, 4))[0])


def _fields(header: bytes) -> Fields:
    fields: Fields = {}
    at = 0
    while at + 4 <= len(header):
        (size,) = _U32.unpack_from(header, at)
        name, equals, value = header[at + 4 : at + 4 + size].partition(b"=")
        if not equals:
            raise CutError("a damaged record header")
        fields[name] = value
        at += 4 + size
    return fields


def _op(fields: Fields) -> int:
    op = fields.get(b"op", b"")
    return op[0] if op else 0


def _unsigned(fields: Fields, name: bytes) -> int:
    value = fields.get(name, b"")
    if len(value) != 4:
        raise CutError(f"a record without {name.decode()}")
    return int(_U32.unpack(value)[0])


def _channel(fields: Fields, data: bytes) -> Channel:
    inner = _fields(data)
    topic = fields.get(b"topic", b"").decode(errors="replace")
    package, _, name = inner.get(b"type", b"").decode(errors="replace").partition("/")
    definition = inner.get(b"message_definition", b"").decode(errors="replace")
    return Channel(_unsigned(fields, b"conn"), topic, f"{package}/msg/{name}", "ros1", definition)
