"""What scans see: whether a point would be seen by a scan, and where the surface lies in a direction.

A point at range rho and bearing phi is visible for a scan when

- phi is within the fan of its beams, widened by half a beam on either side;
- rho is from 0.05 to 30 m and within the range of the scanner;
- it is not occluded: the longest of the readings of the beam nearest to phi and of the two beside it is at least
  rho - ``MARGIN``. No return counts as infinitely long, an invalid reading as unknown (of three: not visible).

The neighbours and the margin leave room for errors of the poses and for corners at the edge of what hides them. A point
is not required to have a surface at it: a corner that is gone counts as visible, and not as found again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groma.nouns.arrays import Array
from groma.nouns.messages import LaserScan
from groma.nouns.poses import wrap

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

NEAREST, FARTHEST = 0.05, 30.0
"""Ranges at which corners are looked for, whatever the detector [m]."""
MARGIN = 0.3
"""How far behind the surface a point may lie without being occluded [m]."""


class Views:
    """S scans, of any number of beams each, asked many times at once.

    Parameters
    ----------
    scans
        With bearings that grow.
    """

    def __init__(self, scans: Sequence[LaserScan]) -> None:
        self._first = np.array([scan.geometry.angle_min for scan in scans])
        step = np.array([scan.geometry.angle_increment for scan in scans])
        self._step = np.where(step > 0, step, np.nan)  # such a scan sees nothing
        self._count = np.array([len(scan.ranges) for scan in scans])
        limits = np.array([(scan.geometry.range_min, scan.geometry.range_max) for scan in scans])
        self._nearest, self._farthest = np.maximum(limits[:, 0], NEAREST), np.minimum(limits[:, 1], FARTHEST)
        self._ranges = _padded([scan.ranges for scan in scans])
        self._longest = _longest_of_three(self._ranges)

    def beams(self, scan: Indices, bearing: Array) -> Indices:
        """Return the beam of scan (P,) nearest to a bearing (P,) [rad]; -1 outside of its fan."""
        last = self._count[scan] - 1
        turn = wrap(bearing - self._first[scan] - 0.5 * last * self._step[scan])
        place = turn / self._step[scan] + 0.5 * last
        inside = (place >= -0.5) & (place <= last + 0.5)
        return np.where(inside, np.rint(place).clip(0, last), -1).astype(np.int64)

    def visible(self, scan: Indices, rho: Array, phi: Array) -> Mask:
        """Return whether points (P,) at ranges [m] and bearings [rad] are visible for scans (P,)."""
        beam = self.beams(scan, phi)
        reached = (rho >= self._nearest[scan]) & (rho <= self._farthest[scan])
        visible: Mask = (beam >= 0) & reached & (self._longest[scan, beam] >= rho - MARGIN)
        return visible

    def surface(self, scan: Indices, bearing: Array) -> Array:
        """Return the range (P,) of the surface at bearings (P,); NaN where no corner could be seen [m]."""
        beam = self.beams(scan, bearing)
        rho = self._ranges[scan, beam]
        seen = (beam >= 0) & (rho >= self._nearest[scan]) & (rho <= self._farthest[scan])
        return np.where(seen, rho, np.nan)


def _padded(rows: Sequence[Array]) -> Array:
    table = np.full((len(rows), max(map(len, rows), default=0) or 1), np.nan)
    for row, ranges in zip(table, rows, strict=True):
        row[: len(ranges)] = ranges
    return table


def _longest_of_three(ranges: Array) -> Array:
    known = np.where(np.isnan(ranges), -np.inf, ranges)
    longest: Array = known.copy()
    np.maximum(longest[:, 1:], known[:, :-1], out=longest[:, 1:])
    np.maximum(longest[:, :-1], known[:, 1:], out=longest[:, :-1])
    return longest
