"""The scans of a recording that an evaluation looks at, each with the pose of the laser.

Every n-th scan of the drive, in order of time (:mod:`groma.recordings.drive`). Poses of the vehicle are those of the
odometry of the recording (in corrected logs these are the corrected ones) or of a given trajectory; between two of them
at most 2 s apart they are interpolated, up to 0.1 s outside the nearest stands. T_map_laser is the pose of the vehicle
times the mounting that the recording tells, at the stamp of the first beam: motion within a sweep is not taken out.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from groma.errors import UserError
from groma.evaluation.association import Matching, look_up
from groma.io.left_out import left_out
from groma.io.recording import Recording
from groma.io.trajectory import Trajectory, read_tum
from groma.nouns.arrays import Array
from groma.nouns.findings import Finding
from groma.nouns.messages import LaserScan, Odometry
from groma.nouns.poses import compose
from groma.recordings.drive import Drive, open_drive

_NEAR_S, _GAP_S = 0.1, 2.0


@dataclass(frozen=True, slots=True)
class PosedScans:
    """N scans of one recording."""

    name: str
    """The recording."""
    source: str
    """Where the poses are from."""
    scans: list[LaserScan]
    """In order of time."""
    poses: Array
    """(N, 3) T_map_laser."""
    total: int
    """Scans of the drive."""
    without_pose: int
    """Scans that would have been looked at, had they a pose."""
    findings: tuple[Finding, ...] = ()
    """What was chosen, assumed and left out."""


def read_posed_scans(recording: Recording, poses: Path | None, every: int) -> PosedScans:
    """Read every n-th scan of a recording with its pose.

    Parameters
    ----------
    recording
        An open recording.
    poses
        TUM trajectory of the vehicle; the odometry of the recording when None.
    every
        1 for all scans.

    Raises
    ------
    UserError
        When a file cannot be read, there is no trajectory, or no scan lies within it.
    """
    path, drive = recording.path, open_drive(recording)
    scans, total, odometry = _gathered(drive, every)
    trajectory = odometry if poses is None else read_tum(poses)
    if trajectory is None:
        raise UserError(f"{path}: no odometry in it: give the poses as TUM with --poses")
    if not scans:
        raise UserError(f"{path}: no scan in it has a time")
    stamps = np.array([scan.stamp for scan in scans])
    found = look_up(trajectory, stamps, Matching("interp", _NEAR_S, _GAP_S))
    if not found.found.any():
        raise UserError(
            f"{poses or path}: no scan has a pose: the scans span {stamps[0]:.3f} to {stamps[-1]:.3f} s, "
            f"the poses {trajectory.stamps[0]:.3f} to {trajectory.stamps[-1]:.3f} s"
        )
    kept = [scan for scan, has_pose in zip(scans, found.found, strict=True) if has_pose]
    mount = np.array([drive.mount.x, drive.mount.y, drive.mount.yaw])
    without = len(scans) - len(kept)
    source = str(poses) if poses else f"{drive.odometry} in the recording"
    findings = [
        *drive.findings(),
        Finding("assumption", f"poses of {source}"),
        *left_out({"poses that are no number or repeat a stamp": trajectory.skipped + trajectory.repeated}),
        *left_out({"scans without a pose": without}),
    ]
    of_laser = compose(found.poses[found.found], mount)
    return PosedScans(str(path), source, kept, of_laser, total, without, tuple(findings))


def _gathered(drive: Drive, every: int) -> tuple[list[LaserScan], int, Trajectory | None]:
    """Return every n-th scan, the number of all, and the odometry; in order of time, whatever that of the file."""
    stamps = sorted({event.stamp for event in drive.events() if isinstance(event, LaserScan)})
    wanted = set(stamps[::every])
    scans: dict[float, LaserScan] = {}
    rows: list[tuple[float, float, float, float]] = []
    for event in drive.events():
        if isinstance(event, Odometry):
            rows.append((event.stamp, event.x, event.y, event.theta))
        elif isinstance(event, LaserScan) and event.stamp in wanted:
            scans.setdefault(event.stamp, event)
    kept = [scans[stamp] for stamp in sorted(scans)]
    if not rows:
        return kept, len(stamps), None
    table = np.array(rows)
    _, first = np.unique(table[:, 0], return_index=True)
    return kept, len(stamps), Trajectory(table[first, 0], table[first, 1:])
