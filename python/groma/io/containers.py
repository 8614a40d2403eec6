"""What the three bag containers (ROS 1 bag, MCAP, sqlite3) have in common: channels, and raw messages in file order.

They are read from front to back, one chunk at a time, so memory does not grow with the bag and a bag that was cut
(power lost, disk full) yields all messages before the cut. The index at the end is used only to say what is inside.
"""

from __future__ import annotations

import bz2
import sys
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, Protocol

from lz4 import frame as _lz4  # type: ignore[import-untyped]

from groma.errors import UserError

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

LARGEST_RECORD = 1 << 28
"""A record that claims more bytes is damaged: writers cut chunks at about a megabyte, an image has tens."""


class CutError(Exception):
    """The container ends early or is damaged; the message says where."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One topic of one type."""

    key: int
    topic: str
    msgtype: str
    """As ``package/msg/Type``."""
    encoding: str
    """``ros1``, ``cdr`` or something groma does not read."""
    definition: str
    """Text of the message definition; empty when the container has none."""
    definition_format: str = "msg"
    """``msg`` or ``idl``."""
    count: int | None = None


Raw = tuple[Channel, int, bytes]
"""Channel, time of recording [ns], serialised message."""


class Container(Protocol):
    """One bag file."""

    path: Path

    def channels(self) -> tuple[list[Channel], bool]:
        """Return the channels and whether an intact index named them (else the file was scanned)."""

    def messages(self, skip: Collection[int]) -> Iterator[Raw]:
        """Yield raw messages in file order, without the channels to skip.

        Raises
        ------
        CutError
            After the last whole message, when the file ends early.
        """


_DECOMPRESSORS: dict[str, Callable[[bytes], Any]] = {
    "": lambda data: data,
    "none": lambda data: data,
    "bz2": bz2.decompress,
    "lz4": _lz4.decompress,
    "zstd": zstd.decompress,
}


def decompress(kind: str, data: bytes, where: str) -> bytes:
    """Return the content of a chunk.

    Raises
    ------
    CutError
        When it is damaged.
    UserError
        When the compression is unknown.
    """
    if kind not in _DECOMPRESSORS:
        raise UserError(f"{where}: chunks are compressed with {kind!r}, which groma cannot undo")
    try:
        return bytes(_DECOMPRESSORS[kind](data))
    except (OSError, ValueError, EOFError, RuntimeError, zstd.ZstdError) as error:
        raise CutError(f"a compressed chunk is damaged ({error})") from error


def exactly(file: IO[bytes], size: int) -> bytes:
    """Read that many bytes.

    Raises
    ------
    CutError
        When they are not there, or nobody writes records that large.
    """
    if size > LARGEST_RECORD:
        raise CutError(f"a record at byte {file.tell()} claims {size} bytes")
    data = file.read(size)
    if len(data) < size:
        raise CutError(f"the file ends in the middle of a record at byte {file.tell()}")
    return data


def scan_channels(container: Container) -> list[Channel]:
    """Return the channels found by reading the whole file, with their counts: for files without an index."""
    found: dict[int, tuple[Channel, int]] = {}
    try:
        for channel, _, _ in container.messages(()):
            found[channel.key] = (channel, found.get(channel.key, (channel, 0))[1] + 1)
    except CutError:
        pass
    return [replace(channel, count=count) for channel, count in found.values()]
