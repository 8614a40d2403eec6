"""From a drive and a map to poses in the map: motions and scans given to a localizer in order of time.

    motions    of the wheels, with a calibrated vehicle; else the steps of the odometry
    scan       corners (FALKO, with BSC) and reflectors, each at the time of its beam
    start      given, or searched for: every scan is asked where it was taken until one knows
    lost       searched for again

Odometry without a calibrated vehicle does not say how good it is. Its steps are given the noise of good wheels that
were not calibrated: ``ODOMETRY``.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import cast

import numpy as np
from numpy.typing import NDArray

from groma.errors import EstimationError, UserError
from groma.features import bsc, falko
from groma.io.drive import Drive
from groma.io.wheel_readings import read_wheels
from groma.localization import Localizer, LocalizerOptions, Observations, Pose, Relocalizer
from groma.localized import Chart, Localized, Track
from groma.models import LaserScan, Odometry
from groma.observations import Kind
from groma.reflectors import reflectors
from groma.vehicle import Vehicle
from groma.wheel_motion import Motions, calibration_covariance, wheel_motions

Array = NDArray[np.float64]
Progress = Callable[[int, str, float], None]
"""Called with scans read, status and standard deviation of the position [m]."""

ODOMETRY = (0.03, 0.03, 0.03)
"""Noise of odometry that nobody calibrated after one metre: along, aside [m], heading [rad]."""
TURNING = 0.05
"""Its noise of the heading after a turn of one radian [rad]."""
GIVEN = (0.2, 0.2, 0.1)
"""Standard deviations of a start in a map that a person gave [m, m, rad]."""
EXACT = (1e-4, 1e-4, 1e-5)
"""Those of a start that is the origin by definition, because there is no map."""


@dataclass(frozen=True, slots=True)
class Step:
    """A motion of the vehicle."""

    stamp: float
    motion: Pose
    covariance: Array
    by_drive: Array | None


@dataclass(slots=True)
class WheelMotion:
    """The steps of calibrated wheels."""

    motions: Motions
    _next: int = 0

    @property
    def start(self) -> float:
        """When the first step begins [s]."""
        return self.motions.start

    def until(self, stamp: float) -> Iterator[Step]:
        """Yield the steps that end up to a time and were not given before."""
        m = self.motions
        while self._next < len(m.stamps) and m.stamps[self._next] <= stamp:
            k = self._next
            self._next += 1
            x, y, turn = m.motions[k].tolist()
            yield Step(float(m.stamps[k]), (x, y, turn), m.covariances[k], m.by_drive[k])


@dataclass(slots=True)
class OdometryMotion:
    """The steps of odometry as it comes."""

    start: float
    _waiting: deque[Odometry] = field(default_factory=deque)
    _last: Odometry | None = None

    def push(self, reading: Odometry) -> None:
        """Take the next reading."""
        self._waiting.append(reading)

    def until(self, stamp: float) -> Iterator[Step]:
        """Yield the steps that end up to a time and were not given before."""
        while self._waiting and self._waiting[0].stamp <= stamp:
            reading = self._waiting.popleft()
            if self._last is not None:
                yield _odometry_step(self._last, reading)
            self._last = reading


def _odometry_step(a: Odometry, b: Odometry) -> Step:
    c, s = np.cos(a.theta), np.sin(a.theta)
    dx, dy = b.x - a.x, b.y - a.y
    turn = float(np.arctan2(np.sin(b.theta - a.theta), np.cos(b.theta - a.theta)))
    motion = (float(c * dx + s * dy), float(c * dy - s * dx), turn)
    variances = np.hypot(dx, dy) * np.square(ODOMETRY)
    variances[2] += TURNING**2 * abs(turn)
    return Step(b.stamp, motion, np.diag(variances), None)


def detect(scan: LaserScan) -> Observations:
    """Return the corners and reflectors of a scan, each at the time of its beam."""
    corners = falko(scan.ranges, scan.geometry)
    marks = reflectors(scan.ranges, scan.intensities, scan.geometry)
    index = np.concatenate([corners.index, marks.index])
    return Observations.at_points(
        scan.stamp + index * scan.geometry.time_increment,
        np.concatenate([corners.point, marks.point]),
        np.concatenate([corners.covariance, marks.covariance]),
        kind=cast(list[Kind], ["corner"] * len(corners) + ["reflector"] * len(marks)),
        orientation=np.concatenate([corners.orientation, np.full(len(marks), np.nan)]),
        descriptor=np.concatenate([bsc(scan.ranges, scan.geometry, corners), np.zeros((len(marks), 16), np.uint8)]),
    )


@dataclass(frozen=True, slots=True)
class Request:
    """What is to be done with a drive."""

    chart: Chart
    options: LocalizerOptions
    start: Pose | None = None
    """``T_map_base`` as x, y [m], theta [rad]; None when it is not known."""
    vehicle: Vehicle | None = None


def localize_drive(drive: Drive, request: Request, progress: Progress | None = None) -> Localized:
    """Localize a drive.

    Parameters
    ----------
    drive
        Scans, and odometry when there is no vehicle, in order of time.
    request
        Map, start, vehicle and settings.
    progress
        Called after every scan.

    Raises
    ------
    UserError
        When a setting is out of range, or the recording has neither odometry nor readings of wheels.
    EstimationError
        When no scan could be used.
    """
    run = _Run(drive, request)
    counts: Counter[str] = Counter()
    for scan in run.scans(counts):
        run.take(scan)
        if progress:
            state = run.track.state[-1]
            progress(len(run.track.state), state.quality.status, state.quality.sigma_position)
    if not run.track.state:
        raise EstimationError(f"{drive.recording.path}: no scan could be used: there is nothing to localize")
    return run.result(counts)


class _Run:
    """One drive on its way through the localizer."""

    def __init__(self, drive: Drive, request: Request) -> None:
        self.drive, self.request = drive, request
        self.track = Track()
        self.localizer: Localizer | None = None
        vehicle = request.vehicle
        mount = drive.mount
        self.mount: Pose = (mount.x, mount.y, mount.yaw) if vehicle is None else vehicle.laser
        self.motion: WheelMotion | OdometryMotion | None = None
        if vehicle is not None:
            stamps, readings = read_wheels(drive.recording, vehicle, drive.skipped)
            self.motion = WheelMotion(wheel_motions(vehicle, stamps, readings))
        elif drive.odometry is None:
            raise UserError(f"{drive.recording.path}: no odometry in it: give a --vehicle, or record odometry")

    def scans(self, counts: Counter[str]) -> Iterator[LaserScan]:
        """Yield the scans; odometry on the way is put aside for the motion."""
        for event in self.drive.events():
            if isinstance(event, LaserScan):
                counts["scans_read"] += 1
                yield event
            elif self.request.vehicle is None:
                counts["odometry_read"] += 1
                if not isinstance(self.motion, OdometryMotion):
                    self.motion = OdometryMotion(event.stamp)
                self.motion.push(event)

    def take(self, scan: LaserScan) -> None:
        """Move the vehicle up to the end of a scan and take the scan in."""
        end = scan.stamp + max(0.0, (len(scan.ranges) - 1) * scan.geometry.time_increment)
        localizer = self._localizer(scan.stamp)
        way = turn = 0.0
        for step in self.motion.until(end) if self.motion else ():
            localizer.predict(step.stamp, step.motion, step.covariance, step.by_drive)
            way += float(np.hypot(*step.motion[:2]))
            turn += abs(step.motion[2])
        observations = detect(scan)
        update = localizer.update(observations, scan)
        self.track.add(localizer.state, update, way, turn)

    def _localizer(self, stamp: float) -> Localizer:
        if self.localizer is None:
            r = self.request
            considered = None if r.vehicle is None or not r.vehicle.names else calibration_covariance(r.vehicle)
            try:
                self.localizer = Localizer(
                    r.chart.landmarks,
                    stamp=self.motion.start if self.motion else stamp,
                    pose=r.start,
                    covariance=np.diag(np.square(EXACT if r.chart.is_empty else GIVEN)),
                    mount=self.mount,
                    calibration=considered,
                    relocalizer=self._relocalizer(),
                    **r.options,
                )
            except ValueError as error:
                raise UserError(f"setting of localize: {error}") from error
        return self.localizer

    def _relocalizer(self) -> Relocalizer | None:
        chart = self.request.chart
        if self.request.options.get("mode") == "dynamic" or (not len(chart.landmarks.seen) and chart.grid is None):
            return None
        return Relocalizer(chart.landmarks, chart.grid)

    def result(self, counts: Counter[str]) -> Localized:
        """Return the value of what was read."""
        return self.track.result(self.request.chart, counts)
