"""A map from poses that are known: landmarks and occupancy of a drive whose trajectory another system gave.

Between two poses the vehicle is taken to move evenly; scans beyond the ends of the trajectory, or in a gap of more than
``GAP`` s, are left out and counted.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma import _core
from groma.errors import EstimationError, UserError
from groma.io.drive import Drive
from groma.io.trajectory import Trajectory
from groma.mapper import STREAMS, beams, to_grid, to_landmarks
from groma.mapping import Landmarks, OccupancyGrid
from groma.models import LaserScan

Array = NDArray[np.float64]
Pose = tuple[float, float, float]

GAP = 1.0
"""Poses farther apart in time are not joined [s]."""


@dataclass(frozen=True, slots=True)
class Surveyed:
    """Landmarks and occupancy in the frame of the poses."""

    grid: OccupancyGrid
    landmarks: Landmarks
    counts: dict[str, int]
    """Scans read, used as keyframes, and left out with the reason."""


def survey(
    drive: Drive,
    trajectory: Trajectory,
    settings: Mapping[str, object],
    *,
    covariances: Array | None = None,
    mount: Pose | None = None,
) -> Surveyed:
    """Map a drive at known poses.

    Parameters
    ----------
    drive
        Scans in order of time; its odometry is not used.
    trajectory
        ``T_map_base`` over time.
    settings
        Those of ``groma map``; what is left out has its default.
    covariances
        (K, 3, 3) of the body-frame perturbations of the poses; zero when left out.
    mount
        ``T_base_laser``; that of the recording when left out.

    Raises
    ------
    UserError
        When a setting is out of range.
    EstimationError
        When no scan was taken at a known pose.
    """
    try:
        core = _core.Survey(json.dumps({key: value for key, value in settings.items() if key not in STREAMS}))
    except ValueError as error:
        raise UserError(f"setting of map: {error}") from error
    path = _Path(trajectory, covariances)
    place = mount or (drive.mount.x, drive.mount.y, drive.mount.yaw)
    counts: Counter[str] = Counter()
    for scan in drive.events():
        if not isinstance(scan, LaserScan):
            continue
        counts["scans_read"] += 1
        known = path.at(scan.stamp)
        if known is None:
            counts["skipped scans without a pose"] += 1
            continue
        pose, covariance, twist = known
        core.push_scan(scan.stamp, scan.ranges, scan.intensities, beams(scan), place, pose, covariance, twist)
    counts["keyframes"] = len(core)
    if not len(core):
        raise EstimationError(
            f"{drive.recording.path}: no scan was taken at a known pose: do the stamps belong together?"
        )
    arrays = core.finish()
    return Surveyed(to_grid(arrays), to_landmarks(arrays), dict(counts))


class _Path:
    """Poses between those that are known."""

    def __init__(self, trajectory: Trajectory, covariances: Array | None) -> None:
        self.stamps = trajectory.stamps
        self.poses = np.column_stack([trajectory.poses[:, :2], np.unwrap(trajectory.poses[:, 2])])
        self.covariances = np.zeros((len(self.stamps), 3, 3)) if covariances is None else covariances

    def at(self, stamp: float) -> tuple[Pose, Array, Pose] | None:
        """Return pose, covariance and twist of the body at a time; None where they are not known."""
        k = int(np.searchsorted(self.stamps, stamp, side="right"))
        if k == len(self.stamps) and len(self.stamps) > 1 and stamp == self.stamps[-1]:
            k -= 1
        if not 0 < k < len(self.stamps) or self.stamps[k] - self.stamps[k - 1] > GAP:
            return None
        time = self.stamps[k] - self.stamps[k - 1]
        share = (stamp - self.stamps[k - 1]) / time
        x, y, theta = (self.poses[k - 1] * (1 - share) + self.poses[k] * share).tolist()
        dx, dy, turn = ((self.poses[k] - self.poses[k - 1]) / time).tolist()
        c, s = np.cos(theta), np.sin(theta)
        nearer = k if share > 0.5 else k - 1
        return (x, y, theta), self.covariances[nearer], (float(c * dx + s * dy), float(c * dy - s * dx), turn)
