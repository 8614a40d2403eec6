from __future__ import annotations

from groma.link.protocol import Odometry
from groma.link.standstill import SETTLE, SHIFT, Standstill


def pose(stamp: float, x: float, theta: float = 0.0, boot: str = "b") -> Odometry:
    return Odometry(sender="robot", boot=boot, sequence=0, stamp=stamp, x=x, y=0.0, theta=theta)


def test_a_robot_stands_when_it_has_not_moved_for_the_time_and_goes_on_at_once() -> None:
    still = Standstill()
    assert not any(still.take(pose(0.05 * i, 0.02 * i)) for i in range(20))
    standing = [still.take(pose(1.0 + 0.05 * i, 0.4)) for i in range(20)]
    assert standing.index(True) == round(SETTLE / 0.05)
    assert all(standing[standing.index(True) :])
    assert not still.take(pose(2.1, 0.45))


def test_creeping_is_not_standing() -> None:
    still = Standstill()
    speed = 1.5 * SHIFT / SETTLE
    assert not any(still.take(pose(0.05 * i, speed * 0.05 * i)) for i in range(200))


def test_turning_in_place_is_not_standing() -> None:
    still = Standstill()
    assert not any(still.take(pose(0.05 * i, 0.0, theta=0.01 * i)) for i in range(100))


def test_a_turn_by_whole_circles_is_none() -> None:
    still = Standstill()
    assert [still.take(pose(0.25 * i, 0.0, theta=6.283185307179586 * i)) for i in range(4)][-1]


def test_poses_of_the_past_change_nothing_and_a_new_start_of_the_robot_begins_anew() -> None:
    still = Standstill()
    assert [still.take(pose(0.25 * i, 1.0)) for i in range(3)] == [False, False, True]
    assert still.take(pose(0.3, 1.0))
    assert not still.take(pose(0.0, 1.0, boot="c"))
