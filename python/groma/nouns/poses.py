"""Poses (..., 3) of the plane as arrays: x [m], y [m], theta [rad], many at once."""

from __future__ import annotations

import numpy as np

from groma.nouns.arrays import Array


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
