"""When a robot stands still, from its odometry: pairs what cameras see with stops instead of clocks.

It stands when within the last `SETTLE` seconds no pose was further than `SHIFT` or `TURN` from the newest; it has gone
on as soon as one is. So vibrations have died away when images are taken. No odometry, no stop.
"""

from __future__ import annotations

import math
from collections import deque

from groma.link.protocol import Odometry

SETTLE = 0.5
"""Time without motion before it counts [s]."""
SHIFT = 0.002
"""[m]."""
TURN = math.radians(0.2)


class Standstill:
    """Tell stops from the poses of the robot, given in the order of time.

    Examples
    --------
    >>> from groma.link.protocol import Odometry
    >>> from groma.link.standstill import Standstill
    >>> still = Standstill()
    >>> def pose(i, x):
    ...     return Odometry(sender="robot", boot="b", sequence=i, stamp=0.1 * i, x=x, y=0.0, theta=0.0)
    >>> [still.take(pose(i, 0.1 * min(i, 3))) for i in range(10)].index(True)
    8
    """

    def __init__(self) -> None:
        self._recent: deque[Odometry] = deque()

    def take(self, pose: Odometry) -> bool:
        """Return whether the robot stands at the time of a pose; poses of the past are passed over."""
        recent = self._recent
        if recent and (pose.boot != recent[-1].boot or _moved(recent[-1], pose)):
            recent.clear()
        if recent and pose.stamp < recent[-1].stamp:
            return self._settled()
        recent.append(pose)
        while len(recent) > 2 and recent[-1].stamp - recent[1].stamp >= SETTLE:
            recent.popleft()
        if any(_moved(old, pose) for old in recent):
            recent.clear()
            recent.append(pose)
        return self._settled()

    def _settled(self) -> bool:
        return self._recent[-1].stamp - self._recent[0].stamp >= SETTLE - 1e-9


def _moved(a: Odometry, b: Odometry) -> bool:
    turn = math.remainder(b.theta - a.theta, math.tau)
    return math.hypot(b.x - a.x, b.y - a.y) > SHIFT or abs(turn) > TURN
