"""Recordings made for tests: lines of text logs, and bags written by the rosbags library."""

from __future__ import annotations

import gzip
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from groma.errors import UserError
from groma.io.recording import Recording, open_recording
from groma.nouns.messages import Message

RANGES = [1.0 + 0.01 * i for i in range(180)]


def flaser(
    ranges: Sequence[object] = RANGES,
    laser: Sequence[float] = (1.2, 2.0, 0.5),
    robot: Sequence[float] = (1.0, 2.0, 0.5),
    times: str = "10.0 host 0.5",
    count: int | None = None,
) -> str:
    fields = ["FLASER", len(ranges) if count is None else count, *ranges, *laser, *robot]
    return " ".join(map(str, fields)) + f" {times}\n"


def drive_lines(scans: int, ranges: Sequence[object] = RANGES, start: float = 100.0) -> list[str]:
    """A robot that drives 0.1 m per scan, with a laser 0.2 m ahead of its centre."""
    return [
        flaser(ranges, (0.1 * k + 0.2, 0.0, 0.0), (0.1 * k, 0.0, 0.0), f"{start + k} host {k}") for k in range(scans)
    ]


def text(path: Path, lines: Iterable[str] | str) -> Path:
    data = "".join(lines).encode()
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)
    return path


def read(path: Path) -> tuple[Recording, list[Message]]:
    recording = open_recording(path)
    return recording, list(recording.messages())


def refusal(path: Path) -> str:
    """Read it whole; return why it was refused, nothing when it was not."""
    try:
        read(path)
    except UserError as error:
        return str(error)
    return ""


class Ros:
    """Messages of one ROS version."""

    def __init__(self, version: int) -> None:
        self.version = version
        self.store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
        if version == 1:
            kind = "tf2_msgs/msg/TFMessage"
            self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", kind))
        self.types: dict[str, Any] = dict(self.store.types)

    def header(self, stamp: float, frame: str) -> Any:
        sec, nanosec = divmod(round(stamp * 1e9), 10**9)
        time = self.types["builtin_interfaces/msg/Time"](sec, nanosec)
        more = {"seq": 0} if self.version == 1 else {}
        return self.types["std_msgs/msg/Header"](stamp=time, frame_id=frame, **more)

    def scan(self, stamp: float, ranges: Sequence[float], frame: str = "laser", **changes: Any) -> tuple[str, Any]:
        values: dict[str, Any] = {
            "angle_min": -1.0,
            "angle_max": -1.0 + 0.01 * (len(ranges) - 1),
            "angle_increment": 0.01,
            "time_increment": 0.0,
            "scan_time": 0.1,
            "range_min": 0.1,
            "range_max": 30.0,
            "intensities": np.empty(0, np.float32),
        } | changes
        kind = "sensor_msgs/msg/LaserScan"
        return kind, self.types[kind](
            header=self.header(stamp, frame), ranges=np.array(ranges, dtype=np.float32), **values
        )

    def odometry(self, stamp: float, x: float, y: float, theta: float) -> tuple[str, Any]:
        t, zeros = self.types, np.zeros(36)
        pose = t["geometry_msgs/msg/Pose"](t["geometry_msgs/msg/Point"](x, y, 0.0), self.quaternion(theta))
        vector = t["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
        return "nav_msgs/msg/Odometry", t["nav_msgs/msg/Odometry"](
            header=self.header(stamp, "/odom"),
            child_frame_id="base_link",
            pose=t["geometry_msgs/msg/PoseWithCovariance"](pose, zeros),
            twist=t["geometry_msgs/msg/TwistWithCovariance"](t["geometry_msgs/msg/Twist"](vector, vector), zeros),
        )

    def joints(self, stamp: float) -> tuple[str, Any]:
        kind = "sensor_msgs/msg/JointState"
        values = np.array([1.0, 2.0]), np.empty(0), np.empty(0)
        return kind, self.types[kind](self.header(stamp, ""), ["left", "right"], *values)

    def transform(self, stamp: float, parent: str, child: str, x: float, theta: float) -> tuple[str, Any]:
        t = self.types
        edge = t["geometry_msgs/msg/Transform"](t["geometry_msgs/msg/Vector3"](x, 0.0, 0.0), self.quaternion(theta))
        stamped = t["geometry_msgs/msg/TransformStamped"](self.header(stamp, parent), child, edge)
        return "tf2_msgs/msg/TFMessage", t["tf2_msgs/msg/TFMessage"]([stamped])

    def text(self) -> tuple[str, Any]:
        return "std_msgs/msg/String", self.types["std_msgs/msg/String"]("hello")

    def quaternion(self, theta: float) -> Any:
        return self.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, np.sin(theta / 2), np.cos(theta / 2))


Entry = tuple[str, float, tuple[str, Any]]
"""Topic, time of recording, message."""


def drive_entries(ros: Ros, scans: int = 40, beams: int = 90) -> list[Entry]:
    """Static mounting, then odometry at 4 times the rate of the scans."""
    entries: list[Entry] = [("/tf_static", 100.0, ros.transform(100.0, "base_link", "laser", 0.3, 0.1))]
    for k in range(scans):
        entries += [("/odom", t, ros.odometry(t, 0.1 * t, 0.0, 0.0)) for t in (100 + k + q / 4 for q in range(4))]
        entries.append(("/scan", 100.0 + k, ros.scan(100.0 + k, np.linspace(1.0, 9.0, beams).tolist())))
    entries.append(("/chatter", 100.0 + scans, ros.text()))
    entries.append(("/joint_states", 100.0 + scans, ros.joints(100.0 + scans)))
    return entries


def bag1(path: Path, entries: Iterable[Entry], compression: Any = None) -> Path:
    ros = Ros(1)
    writer = Writer1(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        connections: dict[str, Any] = {}
        for topic, time, (kind, message) in entries:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=ros.store)
            writer.write(connections[topic], round(time * 1e9), ros.store.serialize_ros1(message, kind))
    return path


def bag2(path: Path, entries: Iterable[Entry], plugin: StoragePlugin, mode: CompressionMode | None = None) -> Path:
    ros = Ros(2)
    writer = Writer2(path, version=9, storage_plugin=plugin)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for topic, time, (kind, message) in entries:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=ros.store)
            writer.write(connections[topic], round(time * 1e9), ros.store.serialize_cdr(message, kind))
    return path


def texts(recording: Recording) -> list[str]:
    """Return what the readers found, in words."""
    return [finding.text for finding in recording.notes.findings()]
