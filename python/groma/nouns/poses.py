"""Poses of the plane as tuples and as arrays (..., 3): x [m], y [m], theta [rad]; rotations as quaternions x, y, z, w.

The only file of the package that computes with poses: what it cannot do belongs into the core.
"""

from __future__ import annotations

import math

import numpy as np

from groma.nouns.arrays import Array

Pose = tuple[float, float, float]
"""x [m], y [m], heading [rad]."""
Quaternion = tuple[float, float, float, float]
"""x, y, z, w."""


def wrap(angle: Array) -> Array:
    """Return the angles in [-pi, pi]."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def compose(a: Array, b: Array) -> Array:
    """Return a b."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    x = a[..., 0] + c * b[..., 0] - s * b[..., 1]
    y = a[..., 1] + s * b[..., 0] + c * b[..., 1]
    return np.stack([x, y, wrap(a[..., 2] + b[..., 2])], axis=-1)


def relative(a: Array, b: Array) -> Array:
    """Return a^-1 b."""
    x, y = b[..., 0] - a[..., 0], b[..., 1] - a[..., 1]
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack([c * x + s * y, -s * x + c * y, wrap(b[..., 2] - a[..., 2])], axis=-1)


def relative_pose(a: Pose, b: Pose) -> Pose:
    """Return a^-1 b of two poses.

    >>> relative_pose((1.0, 2.0, 0.0), (4.0, 2.0, 0.5))
    (3.0, 0.0, 0.5)
    """
    x, y, theta = relative(np.array(a), np.array(b)).tolist()
    return x, y, theta


def transform(pose: Array, points: Array) -> Array:
    """Return points (N, 2), given in the frame of a pose (3,), in the frame in which the pose is given."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.column_stack(
        [pose[0] + c * points[:, 0] - s * points[:, 1], pose[1] + s * points[:, 0] + c * points[:, 1]]
    )


def polar(points: Array) -> tuple[Array, Array]:
    """Return range [m] and bearing [rad] of points (N, 2 or more)."""
    return np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])


def from_polar(rho: Array, bearing: Array) -> Array:
    """Return points (N, 2) from range [m] and bearing [rad]."""
    return np.column_stack([rho * np.cos(bearing), rho * np.sin(bearing)])


def quaternion_of(theta: float) -> Quaternion:
    """Return the rotation by an angle about z."""
    return 0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2)


def quaternions_of(theta: Array) -> Array:
    """Return the rotations by angles (N,) about z as rows x, y, z, w."""
    zero = np.zeros(len(theta))
    return np.column_stack([zero, zero, np.sin(theta / 2), np.cos(theta / 2)])


def quaternion_of_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation about x, then y, then z of the fixed frame."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a / 2), math.cos(a / 2)) for a in (roll, pitch, yaw))
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def rpy_of(rotation: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a quaternion x, y, z, w of any length."""
    length = math.sqrt(sum(q * q for q in rotation))
    x, y, z, w = (q / length for q in rotation)
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    return roll, pitch, yaw_of((x, y, z, w))


def yaw_of(rotation: tuple[float, float, float, float]) -> float:
    """Return the angle about z of a quaternion x, y, z, w of any length."""
    x, y, z, w = rotation
    return math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)


def yaws_of(rotations: Array) -> Array:
    """Return the angles about z of quaternions (N, 4), x, y, z, w, of any length."""
    x, y, z, w = rotations.T
    theta: Array = np.arctan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return theta


def matrices_of(poses: Array) -> Array:
    """Return poses (N, 3) as the first three rows of their transforms, row by row (N, 12)."""
    x, y, theta = poses.T
    c, s, zero, one = np.cos(theta), np.sin(theta), np.zeros(len(poses)), np.ones(len(poses))
    return np.column_stack([c, -s, zero, x, s, c, zero, y, zero, zero, one, zero])


def poses_of(matrices: Array) -> Array:
    """Return the planar part (N, 3) of transforms whose first three rows are given row by row (N, 12)."""
    theta = np.arctan2(matrices[:, 4], matrices[:, 0])
    return np.column_stack([matrices[:, 3], matrices[:, 7], theta])


def align(points: Array, reference: Array) -> Array:
    """Return the rigid motion (3,) that brings points (N, 2) closest to reference points (N, 2).

    With q, q* the points less their means: theta = atan2(sum q x q*, sum q . q*), t = mean p* - R mean p.
    """
    mean, mean_ref = points.mean(axis=0), reference.mean(axis=0)
    (x, y), (u, v) = (points - mean).T, (reference - mean_ref).T
    theta = np.arctan2(np.sum(x * v - y * u), np.sum(x * u + y * v))
    turned = transform(np.array([0.0, 0.0, theta]), mean[None])[0]
    return np.array([*(mean_ref - turned), theta])


def advance(path: float, turn: float) -> Pose:
    """Return the motion along an arc of some length [m] that turns by an angle [rad]."""
    half = turn / 2
    chord = path * (math.sin(half) / half if half else 1.0)
    return chord * math.cos(half), chord * math.sin(half), turn


def rotation_matrix(quaternion: Array) -> Array:
    """Return the (3, 3) matrix of a unit quaternion x, y, z, w."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
