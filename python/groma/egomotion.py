"""How a laser moved between chosen moments, from its scans alone: the Rust core in numpy terms.

A station is a standstill ``(begin, end)``, whose scans are averaged, or a moment ``(t, t)``: the first scan from then
on.
Motions run from each station to the next. Theory: docs/theory/egomotion.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groma import _core
from groma.models import LaserScan

Array = NDArray[np.float64]
Progress = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class LaserMotions:
    """Motions from station to station, in order of time, those that do not count included."""

    start: Array
    """(m,) time at the first station: the middle of a standstill, or of a sweep [s]."""
    end: Array
    """(m,) time at the second [s]."""
    motion: Array
    """(m, 3) x, y [m], theta [rad] of the second seen from the first; theta is the whole turn."""
    covariance: Array
    """(m, 3, 3) of ``T * exp(xi)``."""
    share: Array
    """(m,) of the points of both ends that fit."""
    scale: Array
    """(m,) spread of the residuals [m]."""
    verdict: tuple[str, ...]
    """Empty for a motion that counts, else why it does not."""
    skipped: Counter[str]
    """Scans that were left out, by reason."""


def laser_motions(scans: Iterable[LaserScan], stations: ArrayLike, progress: Progress | None = None) -> LaserMotions:
    """Measure the motions of a laser between stations.

    Parameters
    ----------
    scans
        In order of time.
    stations
        (n, 2) begin and end [s], in order of time.
    progress
        Called with the number of scans after each.
    """
    core = _core.Egomotion(np.asarray(stations, dtype=np.float64).reshape(-1, 2))
    skipped: Counter[str] = Counter()
    for count, scan in enumerate(scans, 1):
        g = scan.geometry
        beams = (g.angle_min, g.angle_increment, g.time_increment, g.range_min, g.range_max)
        if reason := core.push(scan.stamp, np.ascontiguousarray(scan.ranges), beams):
            skipped[f"scans with {reason}"] += 1
        if progress:
            progress(count)
    found = core.finish()
    return LaserMotions(**{**found, "verdict": tuple(found["verdict"])}, skipped=skipped)
