"""Planar poses, and cameras above the floor: from a frame of the building to the floor before a camera and back.

The floor before a camera has its origin at the foot of the camera, x where it looks, y to the left, z up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groma.network import rotation_matrix

Array = NDArray[np.float64]
Pose = tuple[float, float, float]
"""x, y [m], heading [rad]."""
Mount = tuple[float, ...]
"""Position [m], then x, y, z, w."""


def foot_and_mount(camera: Array) -> tuple[Pose, Mount] | None:
    """Return the foot of a camera in some frame, and the camera above it.

    Parameters
    ----------
    camera
        (4, 4) of the camera in that frame, whose floor is z = 0.

    Returns
    -------
    tuple
        None when it is not above the floor, or looks straight up or down.
    """
    if camera[2, 3] <= 0 or math.hypot(camera[0, 2], camera[1, 2]) < 1e-6:
        return None
    foot = (float(camera[0, 3]), float(camera[1, 3]), math.atan2(camera[1, 2], camera[0, 2]))
    mount = np.linalg.inv(planar(foot)) @ camera
    return foot, (*map(float, mount[:3, 3]), *_quaternion(mount[:3, :3]))


def on_floor(foot: Pose, pose: Pose) -> Pose:
    """Return a planar pose as seen from another.

    Examples
    --------
    >>> on_floor((1.0, 2.0, 0.0), (4.0, 2.0, 0.5))
    (3.0, 0.0, 0.5)
    """
    return _pose(np.linalg.inv(planar(foot)) @ planar(pose))


def from_floor(foot: Pose, pose: Pose) -> Pose:
    """Return a planar pose that is given as seen from another, in the frame of that."""
    return _pose(planar(foot) @ planar(pose))


def planar(pose: Pose) -> Array:
    """Return a planar pose as (4, 4)."""
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=np.float64)


def spatial(position: Sequence[float], quaternion: Sequence[float]) -> Array:
    """Return a pose as (4, 4); the quaternion is x, y, z, w."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation_matrix(np.array(quaternion)), position
    return matrix


def _pose(matrix: Array) -> Pose:
    return float(matrix[0, 3]), float(matrix[1, 3]), math.atan2(matrix[1, 0], matrix[0, 0])


def _quaternion(r: Array) -> tuple[float, float, float, float]:
    """Return x, y, z, w of a rotation (3, 3): the eigenvector of the largest eigenvalue (Bar-Itzhack, JGCD 2000)."""
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
            [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
            [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    x, y, z, w = map(float, np.linalg.eigh(k)[1][:, -1])
    return x, y, z, w
