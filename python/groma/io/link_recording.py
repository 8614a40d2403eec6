"""Everything that a survey receives, as it came, in one MCAP file; and the messages of such a file.

A topic a key, the JSON of the message, the time of its arrival; a schema goes with each topic, so that other tools can
show it. What came twice is there twice. The file is written without chunks and handed to the system message by message:
after a crash it lacks its end, and is read up to there.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import msgspec

from groma.errors import UserError
from groma.io.camera_protocol import AnyMessage, Detections, Health, Odometry, Stop, decode
from groma.io.containers import CutError
from groma.io.mcap import Mcap

PREFIX = "groma."
"""Of the names of the schemas."""
_KINDS: tuple[type[msgspec.Struct], ...] = (Detections, Odometry, Stop, Health)


class Recorder:
    """Write messages as they come.

    Parameters
    ----------
    path
        The file; replaced.

    Raises
    ------
    UserError
        When it cannot be written, or the library for MCAP is not there.
    """

    def __init__(self, path: Path) -> None:
        try:
            from mcap.writer import Writer
        except ModuleNotFoundError as error:
            raise UserError("the link needs mcap: pip install 'groma[link]'") from error
        self._path = path
        try:
            self._file: IO[bytes] = path.open("wb")
        except OSError as error:
            raise self._failure(error) from error
        self._writer: Any = Writer(self._file, use_chunking=False)
        self._writer.start(profile="", library="groma")
        self._schemas: dict[str, int] = {}
        self._channels: dict[tuple[str, str], int] = {}

    def write(self, topic: str, message: AnyMessage, data: bytes, arrival: float) -> None:
        """Write one message.

        Parameters
        ----------
        topic
            The key it came under.
        message, data
            The message and its bytes.
        arrival
            Clock of the survey [s].

        Raises
        ------
        UserError
            When the disk does not take it.
        """
        stamp = round(arrival * 1e9)
        try:
            self._writer.add_message(self._channel(topic, message), stamp, data, stamp)
            self._file.flush()
        except OSError as error:
            raise self._failure(error) from error

    def close(self) -> None:
        """Write the end of the file."""
        try:
            self._writer.finish()
            self._file.close()
        except OSError as error:
            raise self._failure(error) from error

    def _channel(self, topic: str, message: AnyMessage) -> int:
        kind = type(message)
        key = (topic, kind.__name__)
        if key not in self._channels:
            if kind.__name__ not in self._schemas:
                schema = json.dumps(msgspec.json.schema(kind)).encode()
                self._schemas[kind.__name__] = self._writer.register_schema(
                    PREFIX + kind.__name__, "jsonschema", schema
                )
            self._channels[key] = self._writer.register_channel(topic, "json", self._schemas[kind.__name__])
        return self._channels[key]

    def _failure(self, error: OSError) -> UserError:
        return UserError(f"{self._path}: cannot be written ({error.strerror}): make room, or choose another with -o")


def read_messages(path: Path) -> Iterator[AnyMessage]:
    """Yield the messages of a recording as they came; a file that lacks its end is read up to there.

    Raises
    ------
    UserError
        When a message in it is not one of this protocol.
    """
    container = Mcap(path)
    try:
        for index, (channel, _, data) in enumerate(container.messages(())):
            if channel.msgtype.startswith(PREFIX):
                yield decode(data, f"{path}: message {index}")
    except CutError:
        return
