"""What wheels do beside what they read, as a process: the covariance that it adds to each motion of the laser.

On a long arc neither slip nor steering error is one number. With the base moved by ``xi_i`` in step i of the readings
and ``A_i = Ad(T_laser_base) Ad(T_i_end^-1)``, which takes an error of that step to the laser at the end of the motion:

    slip       sum_i k^2 |d_i| A_i u_i u_i^T A_i^T                 u_i = d xi / d travel     (of each driven wheel)
    steering   sum_b s^2 g_b g_b^T,  g_b = sum_{i in b} A_i w_i    w_i = d xi / d angle

where a steering error holds for ``HOLDS`` seconds (a block b) and is then another one: as much as one that decays over
half that time. So an arc that lasts longer bends in more than one way, and no direction is left without noise.

Needs a vehicle to compute with: that of a first calibration, in which slip and steering error were one number a motion.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from groma.vehicle import Vehicle, dead_reckoning

Array = NDArray[np.float64]

HOLDS = 6.0
"""For how long a steering error holds [s]."""


def wheel_covariances(
    vehicle: Vehicle, time: Array, readings: Array, start: Array, end: Array, *, slip: float, steering: float
) -> Array:
    """Return the covariances (m, 3, 3) of ``T_start_end * exp(xi)`` of the laser.

    Parameters
    ----------
    vehicle
        Its parameters, the pose of the laser included.
    time, readings
        (n,) [s] and (n, 2) of the wheels.
    start, end
        (m,) times of the scans of each motion [s].
    slip
        Standard deviation of a wheel's travel after one metre [m].
    steering
        Standard deviation of the steering angle [rad].
    """
    poses = dead_reckoning(vehicle, readings)
    travels, ways, angles = _errors(vehicle, readings)
    out = np.zeros((len(start), 3, 3))
    first = np.searchsorted(time, start + vehicle.parameters["delay"])
    last = np.searchsorted(time, end + vehicle.parameters["delay"])
    for k, (i, j) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
        steps = slice(i, max(i, min(j, len(time) - 1)))
        if steps.stop == steps.start:
            continue
        to_end = _to_laser(poses[steps.start + 1 : steps.stop + 1], poses[steps.stop], vehicle)
        for travel, way in zip(travels, ways, strict=True):
            moved = np.einsum("nij,nj->ni", to_end, way[steps])
            out[k] += slip**2 * np.einsum("n,ni,nj->ij", np.abs(travel[steps]), moved, moved)
        if angles is not None:
            bent = np.einsum("nij,nj->ni", to_end, angles[steps])
            for block in _blocks(time[steps]):
                out[k] += steering**2 * np.outer(bent[block].sum(axis=0), bent[block].sum(axis=0))
    return out


def _errors(vehicle: Vehicle, readings: Array) -> tuple[list[Array], list[Array], Array | None]:
    """Return travel (n,) and twist per travel (n, 3) of each driven wheel, and twist per steering angle (n, 3)."""
    p, step = vehicle.parameters, np.diff(readings, axis=0)
    zero = np.zeros(len(step))
    if vehicle.model == "differential":
        half, turn = np.full(len(step), 0.5), np.full(len(step), 1 / p["axle"])
        travels = [p["left_radius"] * step[:, 0], p["right_radius"] * step[:, 1]]
        return travels, [np.column_stack([half, zero, -turn]), np.column_stack([half, zero, turn])], None
    travel = p["drive_scale"] * step[:, 0]
    offset = p.get("steering_offset", p.get("steering_offset_forward", 0.0))
    delta = p["steering_gain"] * (readings[:-1, 1] + readings[1:, 1]) / 2 + offset
    sin, cos = np.sin(delta), np.cos(delta)
    way = np.column_stack([cos, zero, sin / p["wheelbase"]])
    angle = travel[:, None] * np.column_stack([-sin, zero, cos / p["wheelbase"]])
    return [travel], [way], angle


def _to_laser(poses: Array, end: Array, vehicle: Vehicle) -> Array:
    """Return ``Ad(T_laser_base) Ad(T_pose_end^-1)`` (n, 3, 3) of poses of the base."""
    x, y, yaw = vehicle.laser
    dx, dy = end[0] - poses[:, 0], end[1] - poses[:, 1]
    turn = end[2] - poses[:, 2] + yaw
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    ahead, left = c * dx + s * dy, c * dy - s * dx
    c, s = np.cos(end[2] - poses[:, 2]), np.sin(end[2] - poses[:, 2])
    ahead, left = ahead + c * x - s * y, left + s * x + c * y
    c, s = np.cos(turn), np.sin(turn)
    out = np.zeros((len(poses), 3, 3))
    out[:, 0] = np.column_stack([c, s, ahead * s - left * c])
    out[:, 1] = np.column_stack([-s, c, ahead * c + left * s])
    out[:, 2, 2] = 1.0
    return out


def _blocks(time: Array) -> list[slice]:
    """Cut steps into equal blocks of about ``HOLDS`` seconds."""
    count = max(1, round((time[-1] - time[0]) / HOLDS))
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], count + 1))
    edges[-1] = len(time)
    return [slice(a, b) for a, b in pairwise(edges.tolist()) if b > a]
