"""What a vehicle is calibrated from: readings of its wheels, and how its laser moved meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from groma import _core
from groma.nouns.arrays import Array, shaped


@dataclass(frozen=True, slots=True)
class OdometryLog:
    """Readings of the wheels, times strictly rising, counters unwrapped."""

    time: Array
    """(n,) seconds."""
    ticks: Array
    """(n, wheels) cumulative: one column for the drive wheel of a tricycle, left and right for a differential drive.
    Counts or radians: a scale is metres per unit, so that radians give a radius."""
    steering: Array | None = None
    """(n,) angle of the steering encoder [rad], to the left positive; None for a differential drive."""


@dataclass(frozen=True, slots=True)
class SensorMotions:
    """How the laser moved between pairs of scans, in order of time."""

    start: Array
    """(m,) time of the first scan [s]."""
    end: Array
    """(m,) time of the second scan [s], after the first."""
    motion: Array
    """(m, 3) ``T_first_second`` as x, y, theta. Theta is the whole turn, not wrapped: an arc of 240 deg has 240 deg."""
    covariance: Array | None = None
    """(m, 3, 3) of the perturbation ``T * exp(xi)``; None where unknown, then it is estimated, one for all."""
    coupling: Array | None = None
    """(m - 1, 3, 3) covariance of the errors of a motion and the next, which share a scan; None where they are
    independent."""

    @classmethod
    def from_poses(cls, stamps: ArrayLike, poses: ArrayLike, covariances: ArrayLike) -> SensorMotions:
        """Motions between consecutive poses whose errors are independent.

        Parameters
        ----------
        stamps
            (m + 1,) seconds, rising.
        poses
            (m + 1, 3) ``T_map_laser``; theta unwrapped, so that its difference is the whole turn.
        covariances
            (m + 1, 3, 3) of ``T * exp(xi)``.
        """
        time = np.ascontiguousarray(stamps, dtype=np.float64)
        at = shaped("poses", poses, (len(time), 3))
        of_pose = shaped("covariances", covariances, (len(time), 3, 3))
        motion, covariance, coupling = _core.motions_between_poses(time, at, of_pose)
        return cls(time[:-1], time[1:], motion, covariance, coupling)


def to_readings(log: OdometryLog) -> tuple[Array, Array]:
    """Return times and the two numbers of each reading that the core takes."""
    time = np.ascontiguousarray(log.time, dtype=np.float64)
    ticks = np.asarray(log.ticks, dtype=np.float64).reshape(len(time), -1)
    wheels = 2 if log.steering is None else 1
    if time.ndim != 1 or ticks.shape[1] != wheels:
        kind = "a log without steering has 2 wheels" if wheels == 2 else "a log with steering has 1 wheel"
        raise ValueError(f"ticks have shape {np.shape(log.ticks)} for {len(time)} times: {kind}")
    if log.steering is None:
        return time, np.ascontiguousarray(ticks)
    steering = np.asarray(log.steering, dtype=np.float64)
    if steering.shape != time.shape:
        raise ValueError(f"steering has shape {steering.shape}: it must be ({len(time)},), as time")
    return time, np.ascontiguousarray(np.column_stack([ticks[:, 0], steering]))


def to_rows(motions: SensorMotions) -> Array:
    """(m, 5) start, end, x, y, turn."""
    start, end = (np.asarray(t, dtype=np.float64) for t in (motions.start, motions.end))
    motion = np.asarray(motions.motion, dtype=np.float64)
    if start.ndim != 1 or end.shape != start.shape or motion.shape != (len(start), 3):
        shapes = f"{start.shape}, {end.shape}, {motion.shape}"
        raise ValueError(f"start, end and motion have shapes {shapes}: they must be (m,), (m,), (m, 3)")
    return np.ascontiguousarray(np.column_stack([start, end, motion]))


def blocks(name: str, values: Array | None, count: int) -> Array | None:
    """(count, 3, 3) covariances as the core takes them, None where there are none."""
    if values is None:
        return None
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape != (count, 3, 3):
        raise ValueError(f"{name} has shape {array.shape}: it must be ({count}, 3, 3)")
    return array
