"""A map from poses that are known: landmarks and occupancy of a drive whose trajectory another system gave.

Between two poses the body is taken to move with constant twist; scans beyond the ends of the trajectory, or in a pause
of it, are left out and counted. The core says how: docs/theory/mapping.md.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from groma import _core
from groma.errors import EstimationError, UserError
from groma.io.trajectory import Trajectory
from groma.mapping.mapper import STREAMS, beams, to_grid, to_landmarks
from groma.nouns.arrays import Array
from groma.nouns.findings import Finding, of_core
from groma.nouns.maps import Landmarks, OccupancyGrid
from groma.nouns.messages import LaserScan
from groma.nouns.poses import Pose
from groma.recordings.drive import Drive


@dataclass(frozen=True, slots=True)
class Surveyed:
    """Landmarks and occupancy in the frame of the poses."""

    grid: OccupancyGrid
    landmarks: Landmarks
    counts: dict[str, int]
    """Scans read, and used as keyframes."""
    findings: tuple[Finding, ...]
    """What was left out and why."""


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
    place = mount or (drive.mount.x, drive.mount.y, drive.mount.yaw)
    try:
        core = _core.MapAtPoses(json.dumps({k: v for k, v in settings.items() if k not in STREAMS}), place)
    except ValueError as error:
        raise UserError(f"setting of map: {error}") from error
    poses = _Poses(core, trajectory, covariances)
    for scan in drive.events():
        if isinstance(scan, LaserScan):
            poses.push_until(scan.stamp)
            core.push_scan(scan.stamp, scan.ranges, scan.intensities, beams(scan))
    poses.push_until(np.inf)
    arrays = core.finish()
    findings = of_core(arrays.findings)
    for finding in findings:
        if finding.code == "no-estimate":
            raise EstimationError(f"{drive.recording.path}: {finding.text}")
    counts = {"scans_read": arrays.scans, "keyframes": arrays.keyframes}
    return Surveyed(to_grid(arrays.grid), to_landmarks(arrays.landmarks), counts, findings)


class _Poses:
    """The poses of a trajectory, pushed as time goes on."""

    def __init__(self, core: _core.MapAtPoses, trajectory: Trajectory, covariances: Array | None) -> None:
        self._core = core
        exact = np.zeros((3, 3))
        rows = zip(trajectory.stamps.tolist(), trajectory.poses.tolist(), strict=True)
        self._rows: Iterator[tuple[float, Pose, Array]] = (
            (stamp, (x, y, theta), exact if covariances is None else covariances[k])
            for k, (stamp, (x, y, theta)) in enumerate(rows)
        )
        self._next = next(self._rows, None)

    def push_until(self, stamp: float) -> None:
        while self._next is not None and self._next[0] <= stamp:
            self._core.push_pose(*self._next)
            self._next = next(self._rows, None)
