"""The map of a camera network as files: `network.json`, and the cameras as URDF joints and static transforms.

Field by field: docs/reference/camera_network.md.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import msgspec
import numpy as np

from groma import _core
from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.table import read_bytes
from groma.nouns.arrays import Array
from groma.nouns.bounds import in_file, require, require_all
from groma.nouns.camera import Camera
from groma.nouns.network import MappedCamera, NetworkMap
from groma.nouns.poses import rpy_of

VERSION = 1
_ORDER = ["x", "y", "z", "rot_x", "rot_y", "rot_z"]


class _Intrinsics(msgspec.Struct):
    width: int
    height: int
    lens: str
    parameters: tuple[float, ...]
    covariance: list[list[float]]


class _Camera(msgspec.Struct):
    name: str
    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    covariance: list[list[float]]
    intrinsics: _Intrinsics
    views: int
    chi_square_per_dof: float
    since: float
    current: bool


class _Network(msgspec.Struct):
    version: int
    frame: str
    cameras: list[_Camera]
    joint_covariance: list[list[float]] | None


def write_network(path: Path, network: NetworkMap) -> None:
    """Write `network.json`."""
    content = {
        "version": VERSION,
        "frame": "map",
        "units": {"length": "m", "angle": "rad", "image": "px"},
        "covariance_order": _ORDER,
        "cameras": [_camera(camera) for camera in network.cameras],
        "joint_covariance": None if network.joint is None else network.joint.tolist(),
        "mount": {
            "position": network.mount[:3].tolist(),
            "quaternion": network.mount[3:].tolist(),
            "covariance": network.mount_covariance.tolist(),
        },
    }
    write_text(path, json.dumps(content, indent=1) + "\n")


def read_network(path: Path) -> tuple[tuple[MappedCamera, ...], Array | None]:
    """Read the cameras of a `network.json`, and their joint covariance.

    Raises
    ------
    UserError
        When it cannot be read, or is none of this version.
    """
    try:
        found = msgspec.json.decode(read_bytes(path), type=_Network)
        cameras = tuple(_mapped(camera) for camera in found.cameras)
    except (msgspec.DecodeError, ValueError) as error:
        raise UserError(f"{path}: not a network.json: {error}") from error
    if found.version != VERSION:
        raise UserError(f"{path}: version {found.version} of the format, this is {VERSION}")
    joint = None if found.joint_covariance is None else np.array(found.joint_covariance)
    with in_file(path):
        _require(cameras, joint)
    return cameras, joint


def transforms(network: NetworkMap) -> str:
    """Return each camera as a static transform on the command line of ROS 2, one per line."""
    lines = [
        "ros2 run tf2_ros static_transform_publisher "
        + " ".join(f"--{key} {value:.9g}" for key, value in zip(("x", "y", "z"), camera.pose, strict=False))
        + " "
        + " ".join(f"--{key} {value:.9g}" for key, value in zip(("qx", "qy", "qz", "qw"), camera.pose[3:], strict=True))
        + f" --frame-id map --child-frame-id {camera.name}_optical_frame"
        for camera in network.cameras
        if camera.current
    ]
    return "\n".join(lines) + "\n"


def chain(network: NetworkMap) -> dict[str, Array]:
    """Return ``T_cn_cnm1`` (4, 4) of each camera but the first, as Kalibr chains them."""
    cameras = [camera for camera in network.cameras if camera.current]
    if not cameras:
        return {}
    steps = _core.steps_back(np.array([camera.pose for camera in cameras]))
    return {camera.name: step for camera, step in zip(cameras[1:], steps, strict=True)}


def without_k3(camera: Camera) -> Camera:
    """Return a plumb_bob camera whose k3 is zero as radtan, for which Kalibr has a name; any other as it is."""
    if camera.lens != "plumb_bob" or camera.parameters[8] != 0.0:
        return camera
    return Camera(camera.width, camera.height, "radtan", camera.parameters[:8])


def urdf(network: NetworkMap) -> str:
    """Return each camera as a fixed joint of URDF, from the link `map`."""
    parts = ['<robot name="camera_network">', '  <link name="map"/>']
    for camera in network.cameras:
        if not camera.current:
            continue
        xyz = " ".join(f"{value:.9g}" for value in camera.pose[:3])
        angles = " ".join(f"{value:.9g}" for value in rpy_of(_quaternion(camera.pose)))
        link = f"{camera.name}_optical_frame"
        parts += [
            f'  <link name="{link}"/>',
            f'  <joint name="map_to_{camera.name}" type="fixed">',
            '    <parent link="map"/>',
            f'    <child link="{link}"/>',
            f'    <origin xyz="{xyz}" rpy="{angles}"/>',
            "  </joint>",
        ]
    return "\n".join([*parts, "</robot>"]) + "\n"


def _quaternion(pose: Array) -> tuple[float, float, float, float]:
    x, y, z, w = map(float, pose[3:])
    return x, y, z, w


def _camera(camera: MappedCamera) -> dict[str, object]:
    chi = camera.chi_square_per_dof
    return {
        "name": camera.name,
        "position": camera.pose[:3].tolist(),
        "quaternion": camera.pose[3:].tolist(),
        "covariance": camera.covariance.tolist(),
        "intrinsics": {
            "width": camera.camera.width,
            "height": camera.camera.height,
            "lens": camera.camera.lens,
            "parameters": list(camera.camera.parameters),
            "covariance": camera.intrinsics_covariance.tolist(),
        },
        "views": camera.views,
        "chi_square_per_dof": chi if math.isfinite(chi) else 0.0,
        "since": camera.since,
        "current": camera.current,
    }


def _require(cameras: tuple[MappedCamera, ...], joint: Array | None) -> None:
    for camera in cameras:
        require_all("coordinate", f"pose of {camera.name}", camera.pose)
        require_all("variance", f"covariance of {camera.name}", camera.covariance)
        require_all("variance", f"covariance of the lens of {camera.name}", camera.intrinsics_covariance)
        require("stamp", f"since of {camera.name}", camera.since)
    if joint is not None:
        require_all("variance", "joint_covariance", joint)


def _mapped(c: _Camera) -> MappedCamera:
    i = c.intrinsics
    return MappedCamera(
        name=c.name,
        pose=np.array([*c.position, *c.quaternion]),
        covariance=np.array(c.covariance).reshape(6, 6),
        camera=Camera(i.width, i.height, i.lens, i.parameters),
        intrinsics_covariance=np.array(i.covariance).reshape(len(i.parameters), -1),
        views=c.views,
        chi_square_per_dof=c.chi_square_per_dof,
        since=c.since,
        current=c.current,
    )
