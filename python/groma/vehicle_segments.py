"""Where a drive is cut into motions: between standstills, or into windows of ordinary driving.

**Standstills.** Wheels that turn slower than ``STILL`` of their usual speed for ``LEAST_PAUSE`` seconds stand. A margin
at both ends leaves room for a delay between the clocks of wheels and scans, and for the vehicle to settle.

**Stop and go** is a drive with at least ``LEAST_MOVES`` moves between standstills, which last at most ``LONGEST_MOVE``
each: every move is then one motion, whose ends are averaged over many scans. Any other drive is cut into windows of
``window`` seconds wherever the wheels turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from groma.io.wheels import Wheels
from groma.vehicle import Model

Array = NDArray[np.float64]
Kind = Literal["stop and go", "windows"]

STILL = 0.01
"""Share of the usual speed below which a wheel stands."""
LEAST_PAUSE = 0.8
MARGIN = 0.15
LEAST_MOVES = 4
LONGEST_MOVE = 60.0
WINDOW = 0.5
"""Length of a window of ordinary driving when not told [s]."""


@dataclass(frozen=True, slots=True)
class Segments:
    """Stations in order of time; motions run from each to the next."""

    kind: Kind
    stations: Array
    """(n, 2) begin and end of a standstill, or twice the same moment [s]."""


def segments(wheels: Wheels, model: Model, window: float | None = None) -> Segments:
    """Cut a drive.

    Parameters
    ----------
    wheels
        Of the vehicle.
    model
        What drives.
    window
        Length of a window [s]; None: stop and go where the drive is, else ``WINDOW``.
    """
    counters = wheels.readings[:, : 2 if model == "differential" else 1]
    stops = standstills(wheels.time, counters)
    moves = stops[1:, 0] - stops[:-1, 1]
    if window is None and len(moves) >= LEAST_MOVES and moves.max() <= LONGEST_MOVE:
        return Segments("stop and go", stops)
    length = window or WINDOW
    moments = np.arange(wheels.time[0] + MARGIN, wheels.time[-1] - MARGIN, length)
    return Segments("windows", np.column_stack([moments, moments]))


def standstills(time: Array, counters: Array) -> Array:
    """Return begin and end (n, 2) of the standstills, margins taken off [s]."""
    rates = np.abs(np.diff(counters, axis=0)).max(axis=1) / np.diff(time)
    moving = rates[rates > 0]
    if not len(moving):
        return np.empty((0, 2))
    still = rates < STILL * np.percentile(moving, 90)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    spans = np.column_stack([time[edges[::2]], time[edges[1::2]]])
    spans = spans[spans[:, 1] - spans[:, 0] >= LEAST_PAUSE]
    shrunk: Array = spans + np.array([MARGIN, -MARGIN])
    return shrunk


def turned(wheels: Wheels, model: Model, start: Array, end: Array) -> NDArray[np.bool_]:
    """Whether the wheels turned noticeably between two times each (m,)."""
    counters = wheels.readings[:, : 2 if model == "differential" else 1]
    rates = np.abs(np.diff(counters, axis=0)).max(axis=1) / np.diff(wheels.time)
    usual = np.percentile(rates[rates > 0], 90) if (rates > 0).any() else 0.0
    at = [np.column_stack([np.interp(t, wheels.time, column) for column in counters.T]) for t in (start, end)]
    moved: NDArray[np.bool_] = np.abs(at[1] - at[0]).max(axis=1) > STILL * usual * (end - start)
    return moved
