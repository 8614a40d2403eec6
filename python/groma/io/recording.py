"""Open a recording, whatever it is: the content decides, the suffix only helps.

CARMEN logs, DP-SLAM logs, groma CSV, logs for calibration (encoder logs, motion tuples, MINES rover; all plain or
gzipped), ROS 1 bags, ROS 2 bags (folder, bare .mcap, bare .db3).
What is none of these is refused in one line that says what it looks like.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from typing import Protocol

from groma.errors import UserError
from groma.io import bag1, carmen, csv_log, db3, dpslam, encoder_log, mcap, mines, motion_tuples
from groma.io.foreign import looks_like
from groma.io.notes import Notes
from groma.io.streams import Stream
from groma.io.text_lines import head
from groma.nouns.messages import Message

_HEAD = 1 << 16


class Recording(Protocol):
    """Messages of one file or bag; may be read any number of times."""

    @property
    def path(self) -> Path:
        """Where it lies."""

    @property
    def format(self) -> str:
        """What it is, in words."""

    @property
    def notes(self) -> Notes:
        """What the last pass skipped, and what was assumed."""

    @property
    def streams(self) -> tuple[Stream, ...]:
        """What it carries that groma reads."""

    def messages(self, streams: Collection[str] | None = None) -> Iterator[Message]:
        """Yield messages in the order of the recording, one at a time.

        Parameters
        ----------
        streams
            Names of the streams wanted; others are not even decoded. All when None.
        """


def open_recording(path: Path | str) -> Recording:
    """Open a recording of any format that groma reads.

    Parameters
    ----------
    path
        A file, plain or gzipped, or the folder of a ROS 2 bag.

    Raises
    ------
    UserError
        In one line, when there is nothing, or nothing that groma reads.
    """
    path = Path(path)
    if not path.exists():
        raise UserError(f"{path}: no such file or folder")
    if path.is_dir():
        return _open_bag(path)
    start = head(path, _HEAD)
    if start.startswith(_BAG_MAGICS):
        return _open_bag(path)
    for tags, reader in _TEXT_READERS:
        if tags.search(start):
            return reader(path)
    raise UserError(f"{path}: not a recording but {looks_like(path, start)}; {_READS}")


def write_recording(path: Path | str, messages: Iterable[Message]) -> None:
    """Write a recording in the format that the name asks for: ``.csv``, ``.csv.gz`` or ``.mcap``.

    Parameters
    ----------
    path
        The file; it appears when the last message is written.
    messages
        In the order in which they are to be read; taken one at a time.

    Raises
    ------
    UserError
        When the suffix is another, or the file cannot be written.
    """
    path = Path(path)
    if path.name.endswith((".csv", ".csv.gz")):
        csv_log.write(path, messages)
    elif path.suffix == ".mcap":
        from groma.io.ros_encode import write_mcap

        write_mcap(path, messages)
    else:
        raise UserError(f"{path}: recordings are written as .csv, .csv.gz or .mcap: choose one of these")


def _open_bag(path: Path) -> Recording:
    from groma.io.rosbag import open_bag  # half a second of type definitions that text logs do not need

    return open_bag(path)


_BAG_MAGICS = (bag1.MAGIC, mcap.MAGIC, db3.MAGIC)
_READS = "groma reads CARMEN and DP-SLAM logs, ROS 1 and ROS 2 bags, its own CSV and some logs for calibration"


def _first_word(tags: Iterable[str]) -> re.Pattern[bytes]:
    return re.compile(rb"^[ \t]*(" + "|".join(tags).encode() + rb")[ \t]", re.MULTILINE)


_TEXT_READERS: tuple[tuple[re.Pattern[bytes], Callable[[Path], Recording]], ...] = (
    (re.compile(rb"\A# groma csv|^(" + "|".join(csv_log.TAGS).encode() + rb"),", re.MULTILINE), csv_log.CsvRecording),
    (_first_word(carmen.TAGS), carmen.CarmenRecording),
    (_first_word(dpslam.TAGS), dpslam.DpSlamRecording),
    (encoder_log.HEAD, encoder_log.EncoderLogRecording),
    (motion_tuples.HEAD, motion_tuples.TupleRecording),
    (mines.HEAD, mines.MinesRecording),
)
