"""A robot's end of the network: tells its odometry; for a loop of one's own, or to play a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

from groma.io.camera_protocol import SITE, Odometry, data_key, encode
from groma.link.node import new_boot

if TYPE_CHECKING:
    import zenoh


class Robot:
    """Send the poses of a robot as they come.

    Parameters
    ----------
    session
        See :func:`groma.link.session.connect`.
    site
        Name of the network.
    name
        Name of the robot.

    Examples
    --------
    >>> from groma.link.robot import Robot
    >>> from groma.link.session import connect
    >>> with connect("127.0.0.1:17447") as session:
    ...     Robot(session).send(0.0, 1.0, 2.0, 0.1)
    """

    def __init__(self, session: zenoh.Session, site: str = SITE, name: str = "robot") -> None:
        self._session, self._name, self._key = session, name, data_key(site, name)
        self._boot, self._sequence = new_boot(), 0

    def send(self, stamp: float, x: float, y: float, theta: float) -> None:
        """Send T_odom_base (metres, radians) at a time of the robot's clock [s]."""
        pose = Odometry(sender=self._name, boot=self._boot, sequence=self._sequence, stamp=stamp, x=x, y=y, theta=theta)
        self._sequence += 1
        self._session.put(self._key, encode(pose))
