"""Write a recording as one bare MCAP file with ROS 2 messages, as ``ros2 bag record -s mcap`` would.

LaserScan, Odometry (covariances zero: unknown), JointState and TFMessage, CDR-encoded. Streams become topics: a leading
slash is added; of two kinds under one name (a CARMEN
scan line has both) the second becomes ``/name_laserscan`` or the like. All
transforms go to ``/tf`` and ``/tf_static``, the latter transient local, so that a player gives it to late joiners.
ROS keeps ranges and angles as 32-bit floats and times in nanoseconds: what is read back is rounded so.

The library writes folders; the folder is made beside the file and its one MCAP is moved to the file's place.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from groma.errors import UserError
from groma.nouns.messages import JointState, LaserScan, Message, Odometry, Transform
from groma.nouns.poses import quaternion_of

_STORE = get_typestore(Stores.ROS2_JAZZY)
_T: dict[str, Any] = dict(_STORE.types)
_LASER, _ODOM, _JOINTS, _TF = (
    "sensor_msgs/msg/LaserScan",
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/JointState",
    "tf2_msgs/msg/TFMessage",
)
_TYPES: dict[type, str] = {LaserScan: _LASER, Odometry: _ODOM, JointState: _JOINTS, Transform: _TF}
_FOREVER = QosTime(0, 0)


def write_mcap(path: Path, messages: Iterable[Message]) -> None:
    """Write messages as a bare MCAP file.

    Parameters
    ----------
    path
        The file; replaced when the last message is written.
    messages
        In the order of recording, a scan after its last beam; their stamps must not be negative.

    Raises
    ------
    UserError
        When it cannot be written, or a stamp is negative.
    """
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
            bag = Path(folder) / path.stem
            with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
                _write_all(writer, messages)
            os.replace(next(bag.glob("*.mcap")), path)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise UserError(f"{path}: cannot be written ({reason}): free the place or choose another with -o") from error


def _write_all(writer: Writer, messages: Iterable[Message]) -> None:
    topics: dict[tuple[str, str], Connection] = {}
    for message in messages:
        msgtype = _TYPES[type(message)]
        key = (_topic(message), msgtype)
        if key not in topics:
            topics[key] = _connect(writer, *key, taken={topic for topic, _ in topics})
        recorded = _nanoseconds(message.end if isinstance(message, LaserScan) else message.stamp)
        writer.write(topics[key], recorded, _STORE.serialize_cdr(_encode(message), msgtype))


def _topic(message: Message) -> str:
    if isinstance(message, Transform):
        return "/tf_static" if message.static else "/tf"
    return "/" + message.stream.lstrip("/")


def _connect(writer: Writer, topic: str, msgtype: str, taken: set[str]) -> Connection:
    if topic in taken:
        topic = f"{topic}_{msgtype.rpartition('/')[2].lower()}"
    durability = QosDurability.TRANSIENT_LOCAL if topic == "/tf_static" else QosDurability.VOLATILE
    qos = Qos(
        QosHistory.KEEP_LAST,
        10,
        QosReliability.RELIABLE,
        durability,
        _FOREVER,
        _FOREVER,
        QosLiveliness.AUTOMATIC,
        _FOREVER,
        avoid_ros_namespace_conventions=False,
    )
    return writer.add_connection(topic, msgtype, typestore=_STORE, offered_qos_profiles=[qos])


def _nanoseconds(stamp: float) -> int:
    if not (math.isfinite(stamp) and 0 <= stamp < 2**31):
        raise UserError(f"the stamp {stamp} cannot be written to a bag: ROS times run from 0 to 2^31 s")
    return round(stamp * 1e9)


def _header(stamp: float, frame: str) -> Any:
    sec, nanosec = divmod(_nanoseconds(stamp), 1_000_000_000)
    return _T["std_msgs/msg/Header"](_T["builtin_interfaces/msg/Time"](sec, nanosec), frame)


def _encode(message: Message) -> Any:
    if isinstance(message, LaserScan):
        return _laser_scan(message)
    if isinstance(message, Odometry):
        return _odometry(message)
    if isinstance(message, JointState):
        return _joint_state(message)
    return _tf_message(message)


def _laser_scan(scan: LaserScan) -> Any:
    g, count = scan.geometry, len(scan.ranges)
    return _T[_LASER](
        header=_header(scan.stamp, scan.frame),
        angle_min=g.angle_min,
        angle_max=g.angle_min + (count - 1) * g.angle_increment,
        angle_increment=g.angle_increment,
        time_increment=g.time_increment,
        scan_time=0.0,
        range_min=g.range_min,
        range_max=g.range_max,
        ranges=scan.ranges.astype(np.float32),
        intensities=scan.intensities.astype(np.float32),
    )


def _odometry(odometry: Odometry) -> Any:
    vector, zeros = _T["geometry_msgs/msg/Vector3"], np.zeros(36)
    pose = _T["geometry_msgs/msg/Pose"](
        _T["geometry_msgs/msg/Point"](odometry.x, odometry.y, 0.0),
        _quaternion(*quaternion_of(odometry.theta)),
    )
    twist = _T["geometry_msgs/msg/Twist"](vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0))
    return _T[_ODOM](
        header=_header(odometry.stamp, odometry.frame),
        child_frame_id=odometry.child_frame,
        pose=_T["geometry_msgs/msg/PoseWithCovariance"](pose, zeros),
        twist=_T["geometry_msgs/msg/TwistWithCovariance"](twist, zeros),
    )


def _joint_state(joints: JointState) -> Any:
    header = _header(joints.stamp, "")
    return _T[_JOINTS](header, list(joints.names), joints.positions, joints.velocities, np.empty(0))


def _tf_message(edge: Transform) -> Any:
    transform = _T["geometry_msgs/msg/Transform"](
        _T["geometry_msgs/msg/Vector3"](*edge.translation), _quaternion(*edge.quaternion)
    )
    stamped = _T["geometry_msgs/msg/TransformStamped"](_header(edge.stamp, edge.parent), edge.child, transform)
    return _T[_TF]([stamped])


def _quaternion(x: float, y: float, z: float, w: float) -> Any:
    return _T["geometry_msgs/msg/Quaternion"](x, y, z, w)
