"""The data set UTIAS MR.CLAM: robots among coded landmarks, with motion capture as truth, and the localizer on it.

A folder holds ``Landmark_Groundtruth.dat`` (subject, x, y, two standard deviations), ``Barcodes.dat`` (subject, code)
and for each robot ``Robot<n>_{Odometry,Measurement,Groundtruth}.dat``: time, speed, turn rate; time, code, range,
bearing; time, x, y, heading. Files may be gzipped. Robots also see each other: those sightings are left out. Source:
K. Leung et al., "The UTIAS multi-robot cooperative localization and mapping dataset", IJRR 30(8), 2011.

The robots drive about a tenth less than their odometry says: one scale of path and one of turn, for all five, are
calibrated against motion capture over the first two minutes (:func:`calibrated`), as vehicles are before use. Then the
truth gives the pose at the start, and is compared with.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.io.table import read_table
from groma.localization.localizer import Localizer, Observations
from groma.nouns.arrays import Array
from groma.nouns.maps import Landmarks
from groma.nouns.poses import Pose, advance, relative, wrap

_MOST_STEP = 0.1
"""Motions are integrated in steps of this at most [s]."""


@dataclass(frozen=True, slots=True)
class Robot:
    """The drive of one robot."""

    number: int
    odometry: Array
    """(N, 3) stamp [s], speed [m/s], turn rate [rad/s]; each holds until the next."""
    sightings: Array
    """(M, 3) stamp [s], range [m], bearing [rad], in order of time."""
    landmark: NDArray[np.int64]
    """(M,) place of the landmark seen in the map."""
    truth: Array
    """(T, 4) stamp [s], x, y [m], heading [rad] by motion capture."""


@dataclass(frozen=True, slots=True)
class Mrclam:
    """Landmarks and robots."""

    landmarks: Landmarks
    robots: tuple[Robot, ...]


@dataclass(frozen=True, slots=True)
class Noise:
    """Errors of wheels and camera: the noise is stated, the same for all robots."""

    speed_scale: float = 1.0
    """Path driven over path said."""
    turn_scale: float = 1.0
    """Turn made over turn said."""
    along: float = 0.1
    """Standard deviation of the path after one metre [m]; it grows with the root of the way."""
    turn: float = 0.2
    """Standard deviation of the heading after one radian of turn said, and after one metre of distance [rad]."""
    range: float = 0.5
    """Standard deviation of a range [m]: its errors, of some 0.1 m, last for seconds, and do not average out."""
    bearing: float = 0.03
    """Standard deviation of a bearing [rad]."""


@dataclass(frozen=True, slots=True)
class Drive:
    """What the localizer made of a drive."""

    stamp: Array
    """(K,) times of the scans [s]."""
    pose: Array
    """(K, 3)."""
    error: Array
    """(K,) distance from the truth [m]; NaN where the truth has a gap."""
    nees: Array
    """(K,) squared error measured by the covariance; NaN as above."""
    matched: int
    right: int
    """Of those matched, how many with the right landmark."""

    @property
    def rmse(self) -> float:
        """Root mean square distance from the truth [m]."""
        return float(np.sqrt(np.nanmean(self.error**2)))


def read_mrclam(folder: Path) -> Mrclam:
    """Read a data set.

    Raises
    ------
    UserError
        When a file is missing or has a line that is none, naming it.
    """
    surveyed = read_table(_find(folder, "Landmark_Groundtruth.dat"), 5)
    codes = {int(code): int(subject) for subject, code in read_table(_find(folder, "Barcodes.dat"), 2)}
    n = len(surveyed)
    landmarks = Landmarks(
        kinds=np.full(n, "reflector"),
        positions=surveyed[:, 1:3],
        covariances=np.array([np.diag(np.maximum(row, 1e-3) ** 2) for row in surveyed[:, 3:5]]).reshape(-1, 2, 2),
        orientations=np.full(n, np.nan),
        descriptors=np.zeros((n, 16), dtype=np.uint8),
        seen=np.ones(n, dtype=np.int64),
        visible=np.ones(n, dtype=np.int64),
    )
    place = {int(subject): k for k, subject in enumerate(surveyed[:, 0])}
    of_code = {code: place[subject] for code, subject in codes.items() if subject in place}
    numbers = sorted(int(path.name[5 : path.name.index("_")]) for path in folder.glob("Robot*_Odometry.dat*"))
    if not numbers:
        raise UserError(f"{folder}: no Robot<n>_Odometry.dat: not a folder of MR.CLAM")
    return Mrclam(landmarks, tuple(_read_robot(folder, number, of_code) for number in numbers))


def _find(folder: Path, name: str) -> Path:
    paths = (folder / name, folder / f"{name}.gz")
    found = next((path for path in paths if path.is_file()), None)
    if found is None:
        raise UserError(f"{folder / name}: is missing: not a folder of MR.CLAM")
    return found


def _read_robot(folder: Path, number: int, of_code: dict[int, int]) -> Robot:
    table = {
        name: read_table(_find(folder, f"Robot{number}_{name}.dat"), columns)
        for name, columns in (("Odometry", 3), ("Measurement", 4), ("Groundtruth", 4))
    }
    seen = table["Measurement"]
    seen = seen[np.argsort(seen[:, 0], kind="stable")]
    landmark = np.array([of_code.get(int(code), -1) for code in seen[:, 1]], dtype=np.int64)
    known = landmark >= 0
    return Robot(number, table["Odometry"], seen[known][:, [0, 2, 3]], landmark[known], table["Groundtruth"])


def localize(data: Mrclam, robot: Robot, noise: Noise, *, known: bool) -> Drive:
    """Localize a robot from the pose that the truth has at its first odometry.

    Parameters
    ----------
    data, robot
        The data set and one of its robots.
    noise
        Errors of wheels and camera.
    known
        Whether the localizer is told which landmark is seen.
    """
    begin = max(robot.odometry[0, 0], robot.truth[0, 0])
    end = min(robot.odometry[-1, 0], robot.truth[-1, 0])
    start = tuple(_truth(robot, np.array([begin]))[0])
    localizer = Localizer(
        data.landmarks,
        stamp=begin,
        pose=(start[0], start[1], start[2]),
        covariance=np.diag([0.02, 0.02, 0.02]) ** 2,
        lost={"evidence": 1e9},
    )
    wheels = _Wheels(robot.odometry, noise, begin)
    sigma = np.array([noise.range, noise.bearing])
    stamps, poses, covariances = [], [], []
    matched, right = 0, 0
    for stamp, scan in _scans(robot, begin, end):
        for step in wheels.until(stamp):
            localizer.predict(*step)
        identity = robot.landmark[scan] if known else None
        z = robot.sightings[scan]
        seen = Observations.make(
            stamp, z[:, 1], z[:, 2], sigma=(sigma[0], sigma[1]), kind="reflector", landmark=identity
        )
        found = localizer.update(seen)
        matched += len(found.landmark)
        right += int(np.count_nonzero(found.landmark == robot.landmark[scan][found.observation]))
        state = localizer.state
        stamps.append(stamp)
        poses.append(state.pose)
        covariances.append(state.covariance)
    return _compare(robot, np.array(stamps), np.array(poses), np.array(covariances), (matched, right))


def calibrated(robots: Sequence[Robot], *, until: float = 120.0) -> Noise:
    """Return the scales of the wheels of robots of one make, by least squares against motion capture.

    Path and turn of every whole second of the first ``until`` [s] are compared, and averaged over the robots.
    """
    path, turn = np.mean([_scales(robot, until) for robot in robots], axis=0)
    return Noise(speed_scale=float(path), turn_scale=float(turn))


def _scales(robot: Robot, until: float) -> tuple[float, float]:
    begin = max(robot.odometry[0, 0], robot.truth[0, 0])
    seconds = np.arange(begin, begin + until)
    stamps, speed, rate = robot.odometry.T
    time = np.diff(stamps, append=stamps[-1])
    said = [np.diff(np.interp(seconds, stamps, np.cumsum(v * time) - v * time)) for v in (speed, rate)]
    pose = _truth(robot, seconds)
    made = [np.hypot(*np.diff(pose[:, :2], axis=0).T), wrap(np.diff(pose[:, 2]))]
    known = np.isfinite(made[0])
    return _scale(said[0][known], made[0][known]), _scale(said[1][known], made[1][known])


def _scale(said: Array, made: Array) -> float:
    """Return the factor from said to made; 1 where nothing was said."""
    square = float(said @ said)
    return float(said @ made) / square if square > 0 else 1.0


class _Wheels:
    """The motions between two times."""

    def __init__(self, odometry: Array, noise: Noise, begin: float) -> None:
        self._odometry, self._noise, self._now = odometry, noise, begin
        self._next = int(np.searchsorted(odometry[:, 0], begin, side="right"))

    def until(self, stamp: float) -> Iterator[tuple[float, Pose, Array]]:
        while self._now < stamp:
            changes = self._odometry[self._next, 0] if self._next < len(self._odometry) else math.inf
            end = min(stamp, changes, self._now + _MOST_STEP)
            if end > self._now:
                yield end, *self._step(end - self._now)
            self._now = end
            self._next += changes <= end

    def _step(self, time: float) -> tuple[Pose, Array]:
        noise = self._noise
        _, speed, rate = self._odometry[max(self._next - 1, 0)]
        path, turn = noise.speed_scale * speed * time, noise.turn_scale * rate * time
        way = abs(path)
        variance = [noise.along**2 * way, (0.2 * noise.along) ** 2 * way, noise.turn**2 * (abs(turn) + way)]
        return advance(path, turn), np.diag(np.add(variance, 1e-10))


def _scans(robot: Robot, begin: float, end: float) -> Iterator[tuple[float, NDArray[np.int64]]]:
    stamps = robot.sightings[:, 0]
    inside = np.flatnonzero((stamps > begin) & (stamps <= end))
    for stamp, group in groupby(inside.tolist(), key=lambda k: float(stamps[k])):
        yield stamp, np.array(list(group))


def _truth(robot: Robot, stamps: Array) -> Array:
    """Return poses of the truth at times, (K, 3); NaN in gaps of more than half a second."""
    t, x, y, heading = robot.truth.T
    after = np.clip(np.searchsorted(t, stamps), 1, len(t) - 1)
    gap = t[after] - t[after - 1] > 0.5
    poses = np.column_stack([np.interp(stamps, t, v) for v in (x, y, np.unwrap(heading))])
    poses[gap] = np.nan
    return poses


def _compare(robot: Robot, stamps: Array, poses: Array, covariances: Array, sums: tuple[int, int]) -> Drive:
    truth = _truth(robot, stamps)
    d = truth - poses
    local = relative(poses, truth)
    nees = np.einsum("ki,kij,kj->k", local, np.linalg.inv(covariances), local)
    return Drive(stamps, poses, np.hypot(d[:, 0], d[:, 1]), nees, *sums)
