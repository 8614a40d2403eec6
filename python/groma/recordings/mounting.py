"""Where the laser sits on the vehicle: T_base_laser from the edges of a frame tree.

Edges are T_parent_child; the tree is undirected for the search (a driver may publish ``laser -> base``). The planar
part is kept: x, y and yaw, and whether the scanner hangs upside down, which mirrors the order of its beams. A scanner
that is tilted by more than ``TILT`` is told, its planar part is used all the same.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from groma.nouns.arrays import Array
from groma.nouns.messages import Transform

TILT = math.radians(3.0)
"""A scan plane that leans more is not horizontal."""


@dataclass(frozen=True, slots=True)
class Mount:
    """Planar pose of the laser in the frame of the vehicle."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    upside_down: bool = False
    tilt: float = 0.0
    """Angle between the scan plane and the ground [rad]."""


def matrix(edge: Transform) -> Array:
    """Return T_parent_child as a (4, 4) matrix; a zero quaternion is no rotation."""
    x, y, z, w = edge.quaternion
    norm = x * x + y * y + z * z + w * w
    s = 2.0 / norm if norm > 0 else 0.0
    full: Array = np.eye(4)
    full[:3, :3] -= s * np.array(
        [
            [y * y + z * z, w * z - x * y, -w * y - x * z],
            [-w * z - x * y, x * x + z * z, w * x - y * z],
            [w * y - x * z, -w * x - y * z, x * x + y * y],
        ]
    )
    full[:3, 3] = edge.translation
    return full


def chain(edges: Mapping[tuple[str, str], Transform], source: str, target: str) -> Array | None:
    """Return T_source_target along the edges ``(parent, child)``, or None when nothing joins the two frames."""
    neighbours: dict[str, list[tuple[str, Array]]] = {}
    for (parent, child), edge in edges.items():
        forward = matrix(edge)
        neighbours.setdefault(parent, []).append((child, forward))
        backward: Array = np.linalg.inv(forward).astype(np.float64)
        neighbours.setdefault(child, []).append((parent, backward))
    reached: dict[str, Array] = {source: np.eye(4)}
    waiting = deque([source])
    while waiting:
        frame = waiting.popleft()
        for other, step in neighbours.get(frame, []):
            if other not in reached:
                reached[other] = reached[frame] @ step
                waiting.append(other)
    return reached.get(target)


def planar(full: Array) -> Mount:
    """Return the planar part of T_base_laser (4, 4)."""
    upright = float(full[2, 2])
    tilt = math.acos(min(1.0, abs(upright)))
    yaw = math.atan2(full[1, 0], full[0, 0])
    return Mount(float(full[0, 3]), float(full[1, 3]), yaw, upright < 0, tilt)
