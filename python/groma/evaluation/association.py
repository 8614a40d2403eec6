"""The pose of a trajectory at given times.

nearest   the pose of the nearest stamp (of two equally near ones the earlier) when it is within `max_dt`; else, when
          there is an odometry, that pose moved by the odometry's increment between the nearest odometry poses of the
          two times; else none.
interp    between the two neighbours, linear in position and along the shorter arc in angle, when they are at most
          `max_gap` apart; outside the trajectory the end pose within `max_dt`; else none.

Source of `nearest`: the evaluator of Kuemmerle et al., "On measuring the accuracy of SLAM algorithms", Autonomous
Robots 27, 2009; of the odometry a pose within max(max_dt, 1 s) must exist at the time requested.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from groma.io.trajectory import Trajectory
from groma.nouns.arrays import Array
from groma.nouns.poses import compose, relative, wrap

Indices = NDArray[np.int64]
Rule = Literal["nearest", "interp"]

NEAR, ODOMETRY, INTERPOLATED, MISSING = "near", "odometry", "interp", "missing"
_ODOMETRY_REACH = 1.0


@dataclass(frozen=True, slots=True)
class Matching:
    """Which pose represents a time."""

    assoc: Rule = "nearest"
    max_dt: float = 0.1
    """Largest time to the nearest pose [s]."""
    max_gap: float = 2.0
    """Largest gap that is interpolated over [s]."""


@dataclass(frozen=True, slots=True)
class Lookup:
    """Poses at N times."""

    poses: Array
    """(N, 3); NaN where there is none."""
    gaps: Array
    """(N,) time to the nearest stamp of the trajectory [s]."""
    how: NDArray[np.str_]
    """(N,) `near`, `odometry`, `interp` or `missing`."""

    @property
    def found(self) -> NDArray[np.bool_]:
        """(N,) whether there is a pose."""
        return np.asarray(self.how != MISSING)


def look_up(
    trajectory: Trajectory,
    times: Array,
    matching: Matching = Matching(),
    odometry: Trajectory | None = None,
) -> Lookup:
    """Return the poses of a trajectory at times (N,).

    Parameters
    ----------
    trajectory
        At least one pose.
    times
        (N,) seconds, any order.
    matching
        See above.
    odometry
        Used by `nearest` only.
    """
    if matching.assoc == "interp":
        return _interpolated(trajectory, times, matching.max_dt, matching.max_gap)
    return _nearest(trajectory, times, matching.max_dt, odometry)


def nearest(stamps: Array, times: Array) -> Indices:
    """Return the index of the nearest of the sorted stamps for each time, the earlier one of two equally near."""
    after = np.searchsorted(stamps, times).clip(0, len(stamps) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(np.abs(stamps[after] - times) < np.abs(times - stamps[before]), after, before)


def _nearest(trajectory: Trajectory, times: Array, max_dt: float, odometry: Trajectory | None) -> Lookup:
    k = nearest(trajectory.stamps, times)
    gaps = np.abs(trajectory.stamps[k] - times)
    poses = trajectory.poses[k]
    how = np.where(gaps <= max_dt, NEAR, MISSING).astype("<U8")
    if odometry is not None:
        a, b = nearest(odometry.stamps, trajectory.stamps[k]), nearest(odometry.stamps, times)
        reach = np.abs(odometry.stamps[b] - times) <= max(max_dt, _ODOMETRY_REACH)
        fill = (how == MISSING) & reach
        moved = compose(poses, relative(odometry.poses[a], odometry.poses[b]))
        poses, how = np.where(fill[:, None], moved, poses), np.where(fill, ODOMETRY, how)
    return Lookup(np.where((how == MISSING)[:, None], np.nan, poses), gaps, how)


def _interpolated(trajectory: Trajectory, times: Array, max_dt: float, max_gap: float) -> Lookup:
    stamps, poses = trajectory.stamps, trajectory.poses
    after = np.searchsorted(stamps, times).clip(0, len(stamps) - 1)
    before = np.maximum(after - 1, 0)
    inside = (stamps[0] <= times) & (times <= stamps[-1])
    exact = stamps[after] == times
    width = np.where(after > before, stamps[after] - stamps[before], 1.0)
    share = np.where(inside, (times - stamps[before]) / width, times > stamps[-1])
    step = poses[after] - poses[before]
    step[:, 2] = wrap(step[:, 2])
    found = poses[before] + share[:, None] * step
    found[:, 2] = wrap(found[:, 2])
    gaps = np.minimum(np.abs(times - stamps[before]), np.abs(times - stamps[after]))
    near = exact | (~inside & (gaps <= max_dt))
    how = np.select([near, inside & (width <= max_gap)], [NEAR, INTERPOLATED], MISSING)
    return Lookup(np.where((how == MISSING)[:, None], np.nan, found), gaps, how)
