"""ROS messages into ours: LaserScan, Odometry, JointState, TFMessage.

The time is ``header.stamp``; where a driver left it zero, the time of recording, with a note (static transforms hold
at all times: always the time of recording). LaserScan: beam i is at
``angle_min + i * angle_increment`` whatever ``angle_max`` says (where they disagree it is noted); REP-117: ``-inf``
and what is below ``range_min`` become NaN, what reaches ``range_max`` becomes ``+inf`` (drivers from before REP-117
report ``range_max`` when they see nothing). Frames lose a leading slash (tf2 has none).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from groma.io import beams
from groma.io.containers import Channel
from groma.io.notes import Notes
from groma.io.streams import Kind
from groma.nouns.bounds import OutOfRangeError, is_within
from groma.nouns.messages import BeamGeometry, JointState, LaserScan, Message, Odometry, Transform
from groma.nouns.poses import yaw_of

KINDS = {
    "sensor_msgs/msg/LaserScan": Kind.SCAN,
    "nav_msgs/msg/Odometry": Kind.ODOMETRY,
    "sensor_msgs/msg/JointState": Kind.JOINTS,
    "tf2_msgs/msg/TFMessage": Kind.TRANSFORM,
    "tf/msg/tfMessage": Kind.TRANSFORM,
}
_IDL_RULE = "=" * 80 + "\n"


class DecodeError(ValueError):
    """The message does not hold what its type promises."""


class Decoder:
    """Decodes the messages of one bag."""

    def __init__(self, channels: list[Channel], notes: Notes) -> None:
        self._notes = notes
        found = {channel.encoding for channel in channels} & {"cdr", "ros1"}
        self._stores = {encoding: _typestore(channels, encoding) for encoding in found}
        self._geometries: dict[tuple[str, tuple[float, ...]], BeamGeometry] = {}
        self._make: dict[Kind, Callable[[Channel, int, Any], Iterator[Message]]] = {
            Kind.SCAN: self._scan,
            Kind.ODOMETRY: self._odometry,
            Kind.JOINTS: self._joints,
            Kind.TRANSFORM: self._transforms,
        }

    def decode(self, channel: Channel, recorded: int, data: bytes) -> Iterator[Message]:
        """Yield our messages of one ROS message.

        Raises
        ------
        DecodeError
            When the bytes are no such message.
        """
        store = self._stores[channel.encoding]
        try:
            read = store.deserialize_ros1 if channel.encoding == "ros1" else store.deserialize_cdr
            message = read(data, channel.msgtype)
        except Exception as error:  # the library raises whatever its generated code stumbles over
            raise DecodeError(f"{channel.topic}: no {channel.msgtype} ({error or type(error).__name__})") from error
        yield from self._make[KINDS[channel.msgtype]](channel, recorded, message)

    def _time(self, channel: Channel, recorded: int, header: Any) -> float:
        sec, nanosec = header.stamp.sec, header.stamp.nanosec
        if sec == 0 and nanosec == 0 and recorded > 1_000_000_000:
            self._notes.assume(f"{channel.topic}: messages without a stamp: the time of recording is taken")
            return recorded * 1e-9
        return float(sec + nanosec * 1e-9)

    def _scan(self, channel: Channel, recorded: int, message: Any) -> Iterator[LaserScan]:
        ranges = np.array(message.ranges, dtype=np.float64)
        if not len(ranges):
            raise DecodeError(f"{channel.topic}: a scan without readings")
        geometry = self._geometry(channel.topic, message, len(ranges))
        beams.normalise(ranges, geometry.range_min, geometry.range_max, self._notes)
        intensities = np.array(message.intensities, dtype=np.float64)
        if len(intensities) != len(ranges):
            intensities = np.empty(0)
        stamp = self._time(channel, recorded, message.header)
        yield LaserScan(stamp, channel.topic, _frame(message.header.frame_id), geometry, ranges, intensities)

    def _geometry(self, topic: str, m: Any, count: int) -> BeamGeometry:
        said = (m.angle_min, m.angle_increment, m.angle_max, m.time_increment, m.range_min, m.range_max, count)
        key = (topic, said)
        if key not in self._geometries:
            if len(self._geometries) > 1000:  # a driver whose geometry jitters
                self._geometries.clear()
            self._geometries[key] = self._checked(topic, *said)
        return self._geometries[key]

    def _checked(
        self, topic: str, first: float, step: float, last: float, dt: float, nearest: float, longest: float, count: int
    ) -> BeamGeometry:
        if not (math.isfinite(first) and math.isfinite(step)) or (step == 0 and count > 1):
            raise DecodeError(f"{topic}: angle_min {first:g} and angle_increment {step:g} make no fan")
        if step:
            excess = (last - first) / step - (count - 1)
            if abs(excess) > abs(self._notes.angle_max_excess.get(topic, 0.5)):
                self._notes.angle_max_excess[topic] = excess
        if not (longest > beams.RANGE_MIN and is_within("range", longest)):
            self._notes.assume(f"{topic}: range_max {longest:g} m makes no sense; {beams.LONGEST_KNOWN:g} m taken")
            longest = beams.LONGEST_KNOWN
        nearest = nearest if 0 < nearest < longest else beams.RANGE_MIN
        return BeamGeometry(float(first), float(step), float(dt), float(nearest), float(longest))

    def _odometry(self, channel: Channel, recorded: int, message: Any) -> Iterator[Odometry]:
        pose = message.pose.pose
        stamp = self._time(channel, recorded, message.header)
        parent, child = _frame(message.header.frame_id), _frame(message.child_frame_id)
        theta = _yaw(pose.orientation)
        yield Odometry(stamp, channel.topic, pose.position.x, pose.position.y, theta, parent, child)

    def _joints(self, channel: Channel, recorded: int, message: Any) -> Iterator[JointState]:
        names = tuple(str(name) for name in message.name)
        stamp = self._time(channel, recorded, message.header)
        positions, velocities = (_padded(values, len(names)) for values in (message.position, message.velocity))
        yield JointState(stamp, channel.topic, names, positions, velocities)

    def _transforms(self, channel: Channel, recorded: int, message: Any) -> Iterator[Transform]:
        static = channel.topic.endswith("tf_static")
        for edge in message.transforms:
            stamp = recorded * 1e-9 if static else self._time(channel, recorded, edge.header)
            try:
                transform = _transform(edge, stamp, channel.topic, static)
            except OutOfRangeError as error:  # the other edges of the message are good
                self._notes.reject(channel.topic, str(error), error)
                continue
            yield transform


def _transform(edge: Any, stamp: float, topic: str, static: bool) -> Transform:
    t, q = edge.transform.translation, edge.transform.rotation
    parent, child = _frame(edge.header.frame_id), _frame(edge.child_frame_id)
    return Transform(stamp, topic, parent, child, (t.x, t.y, t.z), (q.x, q.y, q.z, q.w), static=static)


def _yaw(q: Any) -> float:
    return yaw_of((q.x, q.y, q.z, q.w))


def _padded(values: Any, count: int) -> NDArray[np.float64]:
    filled = np.full(count, np.nan)
    if len(values) == count:
        filled[:] = values
    return filled


def _frame(name: str) -> str:
    return str(name).lstrip("/")


def _typestore(channels: list[Channel], encoding: str) -> Typestore:
    """Return a store that knows our types as this bag defines them; ROS's own definitions where it does not."""
    store = get_typestore(Stores.LATEST)
    if encoding == "ros1":
        store = get_typestore(Stores.ROS1_NOETIC)
        for name in ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"):  # not in the library's store
            store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", name))
    for channel in channels:
        if channel.encoding != encoding or channel.msgtype not in KINDS:
            continue
        if channel.msgtype in store.fielddefs and not channel.definition:
            continue
        own = get_typestore(Stores.EMPTY)
        try:
            own.register(_definitions(channel))
        except Exception:  # noqa: S112 (a definition that cannot be parsed: ROS's own is used)
            continue
        if own.fielddefs.get(channel.msgtype) != store.fielddefs.get(channel.msgtype):
            store = _replaced(store, own)
    return store


def _replaced(store: Typestore, own: Typestore) -> Typestore:
    merged = get_typestore(Stores.EMPTY)
    merged.register({**store.fielddefs, **own.fielddefs})
    return merged


def _definitions(channel: Channel) -> Any:
    if channel.definition_format != "idl":
        return get_types_from_msg(channel.definition, channel.msgtype)
    parts = [channel.definition]
    if channel.definition.startswith(_IDL_RULE):
        parts = [part.split("\n", 1)[1] for part in channel.definition.split(_IDL_RULE)[1:]]
    types: dict[str, Any] = {}
    for part in parts:
        types.update(get_types_from_idl(part))
    return types
