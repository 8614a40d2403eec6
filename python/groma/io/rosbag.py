"""ROS bags: a ROS 1 ``.bag``, a bare ``.mcap`` or ``.db3``, or the folder of a ROS 2 bag. No ROS is needed.

Read: sensor_msgs/LaserScan, nav_msgs/Odometry, sensor_msgs/JointState, tf2_msgs/TFMessage (tf/tfMessage). Other topics
are counted. Messages come in file order. A bag that was cut, or never got its index, is read up to the cut.
Not read: encrypted bags, ROS 2 bags compressed as whole files (decompress the file first), message encodings other
than CDR and ROS 1.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import chain
from pathlib import Path, PurePath

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from groma.errors import UserError
from groma.io import bag1, db3, mcap
from groma.io.bag1 import Bag1
from groma.io.containers import Channel, Container, CutError, decompress
from groma.io.db3 import Db3
from groma.io.mcap import Mcap
from groma.io.notes import Notes
from groma.io.ros_decode import KINDS, DecodeError, Decoder
from groma.io.streams import Stream
from groma.nouns.bounds import OutOfRangeError
from groma.nouns.messages import Message

_NAMES: dict[type, str] = {Bag1: "ROS 1 bag", Mcap: "MCAP", Db3: "ROS 2 bag (sqlite3)"}
_ENCODINGS = ("ros1", "cdr")


class BagRecording:
    """One bag, of one or more files."""

    def __init__(self, path: Path, containers: list[Container], *, compressed_messages: bool = False) -> None:
        self.path = path
        self.notes = Notes()
        self.format = ("ROS 2 bag folder, " if path.is_dir() else "") + _NAMES[type(containers[0])]
        self._containers = containers
        self._compressed = compressed_messages
        self._channels: list[list[Channel]] = []
        for container in containers:
            channels, indexed = container.channels()
            self._channels.append(channels)
            if not indexed:
                self.notes.assume(f"{container.path.name}: the index is missing or damaged; the file was scanned")
        self.streams = tuple(_streams(chain.from_iterable(self._channels)))
        self._decoder = Decoder(list(chain.from_iterable(self._channels)), self.notes)

    def messages(self, streams: Collection[str] | None = None) -> Iterator[Message]:
        """Yield messages in the order of the file; see :class:`groma.io.recording.Recording`."""
        self.notes.restart()
        for container, channels in zip(self._containers, self._channels, strict=True):
            foreign = [channel for channel in channels if not _is_ours(channel)]
            skip = {c.key for c in channels if not _is_ours(c) or (streams is not None and c.topic not in streams)}
            for channel in foreign:
                self.notes.skipped[f"{channel.topic} [{channel.msgtype}]"] += channel.count or 0
            try:
                yield from self._decoded(container, skip)
            except CutError as error:
                self.notes.cut = f"{container.path.name}: cut or damaged ({error}); the messages before were read"

    def _decoded(self, container: Container, skip: set[int]) -> Iterator[Message]:
        for number, (channel, recorded, data) in enumerate(container.messages(skip), 1):
            if not _is_ours(channel):  # announced only inside the file
                self.notes.skip(f"{channel.topic} [{channel.msgtype}]")
                continue
            try:
                content = decompress("zstd", data, str(self.path)) if self._compressed else data
                yield from self._decoder.decode(channel, recorded, content)
            except (DecodeError, CutError) as error:
                self.notes.reject(f"{container.path.name}: message {number}", str(error))
            except OutOfRangeError as error:
                self.notes.reject(f"{container.path.name}: message {number}", f"{channel.topic}: {error}", error)


def open_bag(path: Path) -> BagRecording:
    """Open a bag file or the folder of a ROS 2 bag.

    Raises
    ------
    UserError
        When it is none, or of a kind that cannot be read.
    """
    if not path.is_dir():
        return BagRecording(path, [_container(path)])
    metadata = _metadata(path)
    mode = str(metadata.get("compression_mode") or "").lower()
    if mode == "file":
        raise UserError(
            f"{path}: the files of this bag are compressed as a whole: run `zstd -d` on them, then open them"
        )
    names = metadata.get("relative_file_paths")
    files = [path / PurePath(str(name)).name for name in (names if isinstance(names, list) else [])]
    missing = [file.name for file in files if not file.exists()]
    if missing or not files:
        raise UserError(f"{path}: files of the bag are missing: {', '.join(missing) or 'metadata.yaml names none'}")
    return BagRecording(path, [_container(file) for file in files], compressed_messages=mode == "message")


def _metadata(folder: Path) -> dict[str, object]:
    place = folder / "metadata.yaml"
    if not place.exists():
        files = sorted(file.name for file in folder.iterdir() if file.suffix in (".mcap", ".db3"))
        if not files:
            raise UserError(f"{folder}: a folder that is no ROS 2 bag: it has no metadata.yaml, no .mcap and no .db3")
        return {"relative_file_paths": files}
    try:
        content = YAML(typ="safe").load(place.read_text(errors="replace"))
        return dict(content["rosbag2_bagfile_information"])
    except (YAMLError, KeyError, TypeError, ValueError, OSError) as error:
        raise UserError(f"{place}: no description of a ROS 2 bag; open the .mcap or .db3 itself") from error


def _container(path: Path) -> Container:
    with path.open("rb") as file:
        start = file.read(16)
    if start.startswith(bag1.MAGIC):
        return Bag1(path)
    if start.startswith(mcap.MAGIC):
        return Mcap(path)
    if start.startswith(db3.MAGIC):
        return Db3(path)
    raise UserError(
        f"{path}: {'an empty file' if not start else 'no bag: it begins with neither bag, mcap nor sqlite3'}"
    )


def _is_ours(channel: Channel) -> bool:
    return channel.msgtype in KINDS and channel.encoding in _ENCODINGS


def _streams(channels: Iterator[Channel]) -> list[Stream]:
    found: dict[tuple[str, str], Stream] = {}
    for channel in channels:
        if not _is_ours(channel):
            continue
        kind = KINDS[channel.msgtype]
        before = found.get((channel.topic, kind))
        counts = [c for c in (channel.count, before.count if before else 0) if c is not None]
        found[(channel.topic, kind)] = Stream(channel.topic, kind, sum(counts) if len(counts) == 2 else None)
    return list(found.values())
