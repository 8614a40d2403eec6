"""When a robot stands still, from its odometry: pairs what cameras see with stops instead of clocks.

The core decides (`docs/theory/camera_network.md`): the robot stands when it has not moved for half a second, and has
gone on as soon as it is two millimetres or a fifth of a degree from where it began to stand. No odometry, no stop.
"""

from __future__ import annotations

from groma import _core
from groma.io.camera_protocol import Odometry


class Standstill:
    """Tell stops from the poses of the robot, given in the order of their arrival.

    Examples
    --------
    >>> from groma.io.camera_protocol import Odometry
    >>> from groma.link.standstill import Standstill
    >>> still = Standstill()
    >>> def pose(i, x):
    ...     return Odometry(sender="robot", boot="b", sequence=i, stamp=0.1 * i, x=x, y=0.0, theta=0.0)
    >>> [still.take(pose(i, 0.1 * min(i, 3))) for i in range(10)].index(True)
    8
    """

    def __init__(self) -> None:
        self._core = _core.Standstill()
        self._newest: Odometry | None = None

    def take(self, pose: Odometry) -> bool:
        """Return whether the robot stands at the time of a pose; poses that were sent again change nothing."""
        newest = self._newest
        if newest is not None and _anew(newest, pose):
            self._core.restart()
            newest = None
        if newest is None or pose.stamp >= newest.stamp:
            self._newest = pose
        return self._core.push(pose.stamp, pose.x, pose.y, pose.theta)


def _anew(newest: Odometry, pose: Odometry) -> bool:
    """Whether the robot started anew, or its clock was set back: a later message has an earlier stamp."""
    return pose.boot != newest.boot or (pose.sequence > newest.sequence and pose.stamp < newest.stamp)
