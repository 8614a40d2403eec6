"""Planar poses, and cameras above the floor: from a frame of the building to the floor before a camera and back.

The floor before a camera has its origin at the foot of the camera, x where it looks, y to the left, z up. The core
computes (crate ``planning``); here its answers have names.
"""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import NDArray

from groma import _core
from groma.nouns.poses import Pose

Mount = tuple[float, ...]
"""Position [m], then x, y, z, w."""


def foot_and_mount(camera: Sequence[float]) -> tuple[Pose, Mount] | None:
    """Return the foot of a camera in some frame, and the camera above it.

    Parameters
    ----------
    camera
        Position [m], then x, y, z, w of the camera in that frame, whose floor is z = 0.

    Returns
    -------
    tuple
        None when it is not above the floor, or looks straight up or down.
    """
    found = _core.foot_of(list(camera))
    return None if found is None else (found[0], tuple(found[1]))


def camera_by_panel(robot: Pose, carried: Sequence[float], seen: NDArray) -> Mount:  # type: ignore[type-arg]
    """Return the camera that sees a panel, in the frame of the robot's pose.

    Parameters
    ----------
    robot
        ``T_a_base``.
    carried
        ``T_base_panel`` as position [m], then x, y, z, w.
    seen
        (4, 4) ``T_camera_panel``.
    """
    return tuple(_core.camera_seeing(robot, list(carried), seen))


def on_floor(foot: Pose, pose: Pose) -> Pose:
    """Return a planar pose as seen from another.

    Examples
    --------
    >>> on_floor((1.0, 2.0, 0.0), (4.0, 2.0, 0.5))
    (3.0, 0.0, 0.5)
    """
    return _core.between(foot, pose)


def from_floor(foot: Pose, pose: Pose) -> Pose:
    """Return a planar pose that is given as seen from another, in the frame of that."""
    return _core.composed(foot, pose)
