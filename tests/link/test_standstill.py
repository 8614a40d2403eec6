from __future__ import annotations

from groma.io.camera_protocol import Odometry
from groma.link.standstill import Standstill


def pose(stamp: float, x: float, theta: float = 0.0, boot: str = "b", sequence: int = 0) -> Odometry:
    return Odometry(sender="robot", boot=boot, sequence=sequence, stamp=stamp, x=x, y=0.0, theta=theta)


def test_a_robot_stands_when_it_has_not_moved_for_half_a_second_and_goes_on_at_once() -> None:
    still = Standstill()
    assert not any(still.take(pose(0.05 * i, 0.02 * i)) for i in range(20))
    standing = [still.take(pose(1.0 + 0.05 * i, 0.4)) for i in range(20)]
    assert standing.index(True) == 10
    assert all(standing[standing.index(True) :])
    assert not still.take(pose(2.1, 0.45))


def test_turning_in_place_is_not_standing() -> None:
    still = Standstill()
    assert not any(still.take(pose(0.05 * i, 0.0, theta=0.01 * i)) for i in range(100))


def test_poses_that_were_sent_again_change_nothing_and_a_new_start_of_the_robot_begins_anew() -> None:
    still = Standstill()
    assert [still.take(pose(0.25 * i, 1.0, sequence=i)) for i in range(3)] == [False, False, True]
    assert still.take(pose(0.3, 9.0, sequence=1))
    assert still.take(pose(0.75, 1.0, sequence=3))
    assert not still.take(pose(0.0, 1.0, boot="c"))


def test_a_clock_that_is_set_back_does_not_stop_the_stops() -> None:
    still = Standstill()
    assert [still.take(pose(100 + 0.25 * i, 1.0, sequence=i)) for i in range(4)][-1]
    again = [still.take(pose(0.25 * i, 1.0, sequence=4 + i)) for i in range(4)]
    assert again == [False, False, True, True]
    assert not still.take(pose(1.25, 2.0, sequence=8))
