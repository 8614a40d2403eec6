from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from groma.localization.localizer import Localizer, Observations, localizer_defaults, reflectors
from groma.localization.relocalizer import Relocalizer
from groma.localization.wheels import Wheels
from groma.nouns.maps import OccupancyGrid
from groma.nouns.messages import BeamGeometry, LaserScan
from groma.nouns.vehicle import WheelNoise

Array = NDArray[np.float64]
MARKS = np.array([[4.0, 0.5], [0.0, 3.0], [5.0, 4.0], [-3.0, 1.0], [-2.0, -4.0], [2.5, -3.5]])


def _seen(pose: Array, stamp: float = 0.0, **more: Any) -> Observations:
    d = MARKS - pose[:2]
    bearing = np.arctan2(d[:, 1], d[:, 0]) - pose[2]
    return Observations.make(
        stamp, np.hypot(*d.T), np.arctan2(np.sin(bearing), np.cos(bearing)), sigma=(0.01, 0.002), **more
    )


def test_finds_back_from_a_wrong_start() -> None:
    pose = np.array([0.05, -0.04, 0.02])
    localizer = Localizer(reflectors(MARKS, 0.001), pose=(0.0, 0.0, 0.0), covariance=np.eye(3) * 0.01)
    for stamp in (0.1, 0.2, 0.3):
        localizer.predict(stamp, (0.0, 0.0, 0.0), np.eye(3) * 1e-8)
        update = localizer.update(_seen(pose, stamp, kind="reflector"))
    assert update.landmark.tolist() == update.observation.tolist() == list(range(6))
    assert update.holds.all()
    np.testing.assert_allclose(localizer.state.pose, pose, atol=1e-4)
    assert localizer.state.quality == update.quality
    assert update.quality.sigma_position < 0.01
    assert update.quality.dof == 12


def test_a_told_identity_is_taken_and_a_wrong_one_gated() -> None:
    pose = np.zeros(3)
    told = np.array([0, 1, 2, 3, 5, 4])
    localizer = Localizer(reflectors(MARKS, 0.001), pose=(0.0, 0.0, 0.0))
    update = localizer.update(_seen(pose, kind="reflector", landmark=told))
    assert update.landmark.tolist() == [0, 1, 2, 3]


def test_kinds_do_not_mix() -> None:
    localizer = Localizer(reflectors(MARKS, 0.001), pose=(0.0, 0.0, 0.0))
    assert len(localizer.update(_seen(np.zeros(3), kind="corner")).landmark) == 0


def test_corners_found_during_the_drive_constrain_the_pose() -> None:
    localizer = Localizer(reflectors(np.empty((0, 2)), 0.001), pose=(0.0, 0.0, 0.0), mode="dynamic")
    pose = np.zeros(3)
    for k in range(1, 30):
        pose[0] += 0.05
        localizer.predict(0.1 * k, (0.048, 0.0, 0.0), np.diag([1e-4, 1e-5, 1e-5]))
        localizer.update(_seen(pose, 0.1 * k))
    assert localizer.found == (6, 0)
    assert localizer.state.quality.status == "tracking"
    # Odometry alone would be 6 cm short.
    assert abs(localizer.state.pose[0] - pose[0]) < 0.012


def test_an_unknown_start_is_found_during_the_drive() -> None:
    marks = reflectors(MARKS, 0.002)
    localizer = Localizer(marks, relocalizer=Relocalizer(marks))
    assert localizer.state.quality.status == "lost"
    pose = np.array([1.0, 0.5, -2.0])
    update = localizer.update(_seen(pose, kind="reflector"))
    assert update.relocated is not None
    assert update.relocated > 0.99
    np.testing.assert_allclose(localizer.state.pose, pose, atol=1e-3)


def test_beams_tell_two_halves_of_a_symmetric_room_apart() -> None:
    corners = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 6.0], [0.0, 6.0]])
    cells = np.zeros((120, 120), dtype=np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    cells[20:40, 90:95] = 100
    grid = OccupancyGrid(0.05, (0.0, 0.0), cells)
    pose = np.array([2.0, 3.0, 0.4])
    geometry = BeamGeometry(-np.pi, np.pi / 180, 0.0, 0.1, 20.0)
    angles = geometry.angle_min + geometry.angle_increment * np.arange(360) + pose[2]
    steps = np.arange(0.1, 9.0, 0.01)
    x = pose[0] + np.outer(np.cos(angles), steps)
    y = pose[1] + np.outer(np.sin(angles), steps)
    hit = cells[np.clip(y / 0.05, 0, 119).astype(int), np.clip(x / 0.05, 0, 119).astype(int)] == 100
    scan = LaserScan(0.0, "scan", "laser", geometry, steps[hit.argmax(axis=1)])
    marks = reflectors(corners, 0.01)
    d = corners - pose[:2]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    points = d @ np.array([[c, -s], [s, c]])
    seen = Observations.at_points(0.0, points, np.tile(np.eye(2) * 1e-4, (4, 1, 1)), kind="reflector")
    alone = Relocalizer(marks).locate(seen)
    assert len(alone) == 4
    assert all(abs(place.probability - alone[0].probability) < 0.05 for place in alone)
    best, second, *_ = Relocalizer(marks, grid).locate(seen, scan)
    np.testing.assert_allclose(best.pose, pose, atol=0.02)
    assert best.probability > 0.8 > 0.2 > second.probability


def test_wheels_predict_with_the_calibration_considered() -> None:
    fork = Wheels("tricycle", (2.5e-4, 1.5, 1.0, 0.0, 0.0), WheelNoise(3e-5, 0.0, 1.0))
    calibration = np.zeros((8, 8))
    calibration[0, 0] = (2.5e-6) ** 2
    localizer = Localizer(
        reflectors(MARKS, 0.001), pose=(0.0, 0.0, 0.0), covariance=np.zeros((3, 3)), calibration=calibration
    )
    for k in range(1, 101):
        localizer.predict(0.1 * k, *fork.motion(400.0, 0.0, 0.1))
    # A scale that is one percent off is a centimetre a metre: errors that last add up.
    assert localizer.state.pose[0] == pytest.approx(10.0)
    assert np.sqrt(localizer.state.covariance[0, 0]) == pytest.approx(0.1, rel=0.01)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Localizer(reflectors(MARKS, 0.0)), "landmark 0 of the map"),
        (lambda: Localizer(reflectors(MARKS, 1.0), gate=2.0), "gate = 2"),
        (
            lambda: Localizer(reflectors(MARKS, 1.0), gait=0.9),  # type: ignore[call-arg]
            "unknown field `gait`",
        ),
        (lambda: Localizer(reflectors(MARKS, 1.0), pose=(np.nan, 0.0, 0.0)), "x = NaN"),
        (lambda: Localizer(reflectors(MARKS, 1.0), calibration=np.eye(3)), r"must be \(8, 8\)"),
        (lambda: Relocalizer(reflectors(MARKS, 1.0), tolerance=-1.0), "tolerance = -1"),
        (lambda: Observations.make(0.0, [1.0], [0.0]), "either sigma or covariance"),
        (lambda: Observations.make(0.0, [1.0], [0.0, 1.0], sigma=(1, 1)), r"must be \(1,\)"),
        (lambda: Wheels("tricycle", (1.0, 2.0, 3.0)), "a tricycle has 5"),
    ],
)
def test_says_what_cannot_be_used(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


def test_time_that_goes_back_is_refused_and_changes_nothing() -> None:
    localizer = Localizer(reflectors(MARKS, 0.001), stamp=5.0, pose=(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="time goes back: a motion ends at 4 s, after one that ended at 5 s"):
        localizer.predict(4.0, (1.0, 0.0, 0.0), np.eye(3))
    assert localizer.state.stamp == 5.0
    assert localizer.state.pose == (0.0, 0.0, 0.0)


def test_defaults_name_every_option() -> None:
    from groma.localization.options import LocalizerOptions

    assert set(localizer_defaults()) == set(LocalizerOptions.__annotations__)
