"""The messages that a node has numbered, kept on its disk so that they can be sent again, even after a crash.

One folder a node, one file a boot: `BOOT.jsonl`, a message a line, in the order of their numbers. A line is written and
handed to the system before the message is sent; so the number of a message that was sent is never given to another. A
line that was cut by a crash is not a message: it was never sent. The oldest boots are dropped at a start when the
folder has grown beyond its size. The bytes are not forced to the disk: a power cut may lose the last ones.
"""

from __future__ import annotations

import os
from pathlib import Path

from groma.errors import UserError
from groma.io.camera_protocol import Numbered, encode

SIZE_MAX = 256 << 20
"""Bytes of older boots that are kept."""


class Journal:
    """Messages of this boot and of those before.

    Parameters
    ----------
    directory
        Made when missing; one node uses it at a time.
    boot
        Name of this boot; sorts behind those before.

    Raises
    ------
    UserError
        When the directory cannot be used.
    """

    def __init__(self, directory: Path, boot: str) -> None:
        self._directory, self._boot = directory, boot
        self._offsets: dict[str, list[int]] = {}
        try:
            directory.mkdir(parents=True, exist_ok=True)
            _drop_oldest(directory)
            for path in sorted(directory.glob("*.jsonl")):
                self._offsets[path.stem] = _line_ends(path)
            self._file = (directory / f"{boot}.jsonl").open("xb")
        except OSError as error:
            raise UserError(f"{directory}: cannot be used as a journal ({error.strerror}): choose another") from error
        self._offsets[boot] = [0]

    @property
    def counts(self) -> dict[str, int]:
        """How many messages each boot has."""
        return {boot: len(ends) - 1 for boot, ends in self._offsets.items()}

    def append(self, message: Numbered) -> bytes:
        """Keep the next message of this boot and return its bytes.

        Raises
        ------
        OSError
            When the disk does not take it; the message is then as if never numbered.
        """
        data = encode(message)
        ends = self._offsets[self._boot]
        try:
            self._file.write(data + b"\n")
            self._file.flush()
        except OSError:
            os.ftruncate(self._file.fileno(), ends[-1])
            raise
        ends.append(ends[-1] + len(data) + 1)
        return data

    def read(self, boot: str, first: int, last: int) -> list[bytes]:
        """Return the messages first..=last of a boot, as far as they are there."""
        ends = self._offsets.get(boot, [0])
        last = min(last, len(ends) - 2)
        if first > last:
            return []
        with (self._directory / f"{boot}.jsonl").open("rb") as file:
            file.seek(ends[first])
            return file.read(ends[last + 1] - ends[first]).splitlines()

    def close(self) -> None:
        """End the file; nothing is lost without it."""
        self._file.close()


def _line_ends(path: Path) -> list[int]:
    """Return 0 and the offset behind each whole line."""
    ends = [0]
    with path.open("rb") as file:
        for line in file:
            if line.endswith(b"\n"):
                ends.append(ends[-1] + len(line))
    return ends


def _drop_oldest(directory: Path) -> None:
    """Remove the oldest boots until the rest fits."""
    size = 0
    for path in sorted(directory.glob("*.jsonl"), reverse=True):
        size += path.stat().st_size
        if size > SIZE_MAX:
            path.unlink()
