"""Rigid motions as matrices, for tests: written apart from the core that they check."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groma.nouns.poses import rotation_matrix

Array = NDArray[np.float64]


def planar(pose: tuple[float, float, float]) -> Array:
    """Return x, y, heading as (4, 4)."""
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=np.float64)


def spatial(position: Sequence[float], quaternion: Sequence[float]) -> Array:
    """Return a position and x, y, z, w as (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation_matrix(np.array(quaternion)), position
    return matrix


def seven(matrix: Array) -> list[float]:
    """Return position and x, y, z, w: the eigenvector of the largest eigenvalue (Bar-Itzhack, JGCD 2000)."""
    r = matrix[:3, :3]
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
            [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
            [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    return [*matrix[:3, 3].tolist(), *np.linalg.eigh(k)[1][:, -1].tolist()]
