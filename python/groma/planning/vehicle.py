"""Plan which arcs calibrate a vehicle: as good as wanted, in the least time, on the floor that there is.

Every arc goes from standstill to standstill at one steering angle. Formulas and sources:
docs/theory/vehicle_calibration.md.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import SupportsFloat, SupportsIndex, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from groma import _core
from groma.nouns.arrays import Array

Numbers = dict[str, SupportsFloat | SupportsIndex]
"""Numbers by name, as the core takes them."""


class PlanLimits(TypedDict, total=False):
    """What may be driven; the defaults are those of the core."""

    angle_min: float
    """Least steering angle to either side [rad]."""
    angle_max: float
    """Largest steering angle to either side [rad]."""
    turn_max: float
    """Largest turn of the vehicle in one arc [rad]."""
    path_max: float
    """Longest path of a wheel in one arc [m]."""
    speed: float
    """Speed of the wheel [m/s]."""
    acceleration_max: float
    """Largest lateral acceleration [m/s^2]."""
    overhead: float
    """Time that an arc takes beside driving [s]."""


@dataclass(frozen=True, slots=True)
class VehiclePlan:
    """Arcs in the order of driving."""

    steering: Array
    """(n,) angle of the steering encoder [rad]; radius of the arc [m] for a differential drive. Left is positive."""
    path: Array
    """(n,) path of the drive wheel, or of the faster wheel, negative backward [m]."""
    speed: Array
    """(n,) speed of that wheel [m/s]."""
    turn: Array
    """(n,) turn of the vehicle [rad]."""
    base: Array
    """(n,) path of the base, negative backward [m]."""
    start: Array
    """(n, 3) where the base stands at the start, x, y, heading on the floor; zeros without a floor."""
    sigmas: dict[str, float]
    """Standard deviations that the plan gives, by name."""
    time: float
    """What it takes, stops included [s]."""
    bound: float
    """No plan of these arcs takes less [s]; NaN for a grid, which is not planned."""


def plan_limits() -> dict[str, float]:
    """Return the default of every limit."""
    limits: dict[str, float] = json.loads(_core.vehicle_plan_defaults()[0])
    return limits


def plan_vehicle(
    model: str,
    parameters: Mapping[str, float],
    sigmas: Mapping[str, float],
    *,
    free: Iterable[str] = (),
    floor: ArrayLike | None = None,
    footprint: tuple[float, float, float] = (0.0, 0.0, 0.0),
    noise: Mapping[str, float] | None = None,
    token: _core.Token | None = None,
    **limits: Unpack[PlanLimits],
) -> VehiclePlan:
    """Find the arcs that give these standard deviations in the least time.

    Parameters
    ----------
    model
        ``tricycle``, ``tricycle-asymmetric`` or ``differential``.
    parameters
        The vehicle, about, by name.
    sigmas
        Standard deviations wanted, by name of a free parameter; for the others that of a tape measure will do.
    free
        What is estimated too: ``wheelbase``, ``gain``.
    floor
        (k, 2) corners of the floor in order [m]; room enough where left out.
    footprint
        Reach of the vehicle ahead of its base, behind it, and to either side [m].
    noise
        Standard deviations: ``place`` [m], ``heading`` [rad] of a motion, ``slip`` after a metre [m], ``steering``
        [rad], which lasts for ``memory`` [s].
    token
        Cancels the work; KeyboardInterrupt tells so.
    **limits
        See :class:`PlanLimits`.

    Raises
    ------
    EstimationError
        If no arc fits, or those that fit do not hold the parameters.
    ValueError
        If a name is unknown, a parameter is missing, a number is out of range or the floor is none.
    """
    room = None
    if floor is not None:
        corners = np.asarray(floor, dtype=np.float64).reshape(-1, 2)
        room = ([(x, y) for x, y in corners.tolist()], footprint)
    rows, reached, time, bound = _core.vehicle_plan(
        model, *_wanted(parameters, free, sigmas), json.dumps(noise or {}), json.dumps(limits), room, token
    )
    return _plan(rows, dict(reached), time, bound)


def thesis_grid(
    model: str,
    parameters: Mapping[str, float],
    sigmas: Mapping[str, float],
    count: int,
    turn: float,
    *,
    free: Iterable[str] = (),
    noise: Mapping[str, float] | None = None,
    **limits: Unpack[PlanLimits],
) -> tuple[VehiclePlan, float]:
    """Lay out the grid of the thesis: ``count`` steering angles, left and right, forward and backward.

    Parameters
    ----------
    model, parameters, sigmas, free, noise, **limits
        As in :func:`plan_vehicle`.
    count, turn
        Number of angles, and the turn of every arc [rad].

    Returns
    -------
    tuple
        The grid, and how many times it must be driven for the wanted standard deviations, not whole; infinite where it
        does not hold the parameters.
    """
    rows, needed = _core.vehicle_grid(
        model, *_wanted(parameters, free, sigmas), json.dumps(noise or {}), json.dumps(limits), count, turn
    )
    overhead = limits.get("overhead", plan_limits()["overhead"])
    time = sum(abs(float(row[1])) / float(row[2]) + overhead for row in rows)
    return _plan(rows, {}, time, float("nan")), float("inf") if needed is None else needed[0] / len(rows)


def _wanted(
    parameters: Mapping[str, float], free: Iterable[str], sigmas: Mapping[str, float]
) -> tuple[Numbers, list[str], Numbers]:
    return {**parameters}, list(free), {**sigmas}


def _plan(rows: Sequence[tuple[float, ...]], sigmas: dict[str, float], time: float, bound: float) -> VehiclePlan:
    table = np.array(rows, dtype=np.float64).reshape(-1, 8)
    steering, path, speed, turn, base = table[:, :5].T
    return VehiclePlan(steering, path, speed, turn, base, table[:, 5:], sigmas, time, bound)
