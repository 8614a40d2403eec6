"""Corners and reflectors as the beams of a scan saw them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groma import _core
from groma.nouns.arrays import Array, shaped
from groma.nouns.messages import LaserScan

Kind = Literal["corner", "reflector"]
Beams = tuple[float, float, float, float]

_KINDS = np.array(["corner", "reflector"])


@dataclass(frozen=True, slots=True)
class Observations:
    """N corners and reflectors as beams of a scan saw them, in polar coordinates of the laser."""

    stamp: Array
    """(N,) when the beam was fired [s]."""
    range: Array
    """(N,) [m]."""
    bearing: Array
    """(N,) [rad]."""
    covariance: Array
    """(N, 2, 2) of range and bearing."""
    kind: NDArray[np.str_]
    """(N,) ``corner`` or ``reflector``."""
    orientation: Array
    """(N,) direction into which the corner opens, in the laser frame [rad]; NaN where it was not measured."""
    descriptor: NDArray[np.uint8]
    """(N, 16) binary shape context as :func:`groma.features.corners.bsc` gives it; zeros where there is none."""
    landmark: NDArray[np.int64]
    """(N,) which landmark of the map it is, where that is known (a coded mark); -1 elsewhere."""

    def __len__(self) -> int:
        return len(self.range)

    @classmethod
    def make(
        cls,
        stamp: ArrayLike,
        range: ArrayLike,  # noqa: A002 - the name of the quantity
        bearing: ArrayLike,
        *,
        sigma: tuple[float, float] | None = None,
        covariance: ArrayLike | None = None,
        kind: Kind | Sequence[Kind] = "corner",
        orientation: ArrayLike | None = None,
        descriptor: ArrayLike | None = None,
        landmark: ArrayLike | None = None,
    ) -> Observations:
        """Make observations from their numbers.

        Parameters
        ----------
        stamp
            One time for all, or (N,) [s].
        range, bearing
            (N,) [m], [rad].
        sigma
            Standard deviations of range [m] and bearing [rad], the same for all; or give ``covariance``.
        covariance
            (N, 2, 2) of range and bearing.
        kind
            One for all, or N.
        orientation, descriptor, landmark
            As in the class; none where left out.

        Raises
        ------
        ValueError
            If neither or both of ``sigma`` and ``covariance`` are given, or the arrays differ in length.
        """
        ranges = np.atleast_1d(np.asarray(range, dtype=np.float64))
        n = len(ranges)
        if (sigma is None) == (covariance is None):
            raise ValueError("observations need either sigma or covariance")
        one = np.diag(np.square(sigma)) if sigma is not None else np.zeros((2, 2))
        return cls(
            stamp=np.broadcast_to(np.asarray(stamp, dtype=np.float64), n).copy(),
            range=ranges,
            bearing=shaped("bearing", bearing, (n,)),
            covariance=np.tile(one, (n, 1, 1)) if covariance is None else shaped("covariance", covariance, (n, 2, 2)),
            kind=np.broadcast_to(np.asarray(kind, dtype=np.str_), n).copy(),
            orientation=np.full(n, np.nan) if orientation is None else shaped("orientation", orientation, (n,)),
            descriptor=_cells(descriptor, n),
            landmark=np.full(n, -1) if landmark is None else np.asarray(landmark, dtype=np.int64).reshape(n),
        )

    @classmethod
    def at_points(
        cls,
        stamp: ArrayLike,
        point: ArrayLike,
        covariance: ArrayLike,
        *,
        kind: Kind | Sequence[Kind] = "corner",
        orientation: ArrayLike | None = None,
        descriptor: ArrayLike | None = None,
    ) -> Observations:
        """Make observations of points in the laser frame, such as :class:`groma.features.corners.Keypoints`.

        Parameters
        ----------
        stamp
            One time for all, or (N,) [s].
        point
            (N, 2) [m].
        covariance
            (N, 2, 2) of the points [m^2].
        kind, orientation, descriptor
            As in :meth:`make`.
        """
        points = np.ascontiguousarray(point, dtype=np.float64).reshape(-1, 2)
        # A point on the laser has no bearing: the localizer refuses it.
        polar, c = _core.points_seen(points, shaped("covariance", covariance, (len(points), 2, 2)))
        r, angles = polar.T
        return cls.make(stamp, r, angles, covariance=c, kind=kind, orientation=orientation, descriptor=descriptor)

    def rows(self) -> Array:
        """Return (N, 8): stamp, range, bearing, covariance row by row, orientation."""
        flat = self.covariance.reshape(-1, 4)
        return np.column_stack([self.stamp, self.range, self.bearing, flat, self.orientation])


class Observer:
    """Observes the corners and reflectors of scans, each at the time of its beam.

    What it keeps for a scanner lasts from scan to scan: use one observer a scanner.
    """

    def __init__(self) -> None:
        self._core = _core.Observer()

    def observe(self, scan: LaserScan) -> Observations:
        """Return the corners of a scan in beam order, then its reflectors."""
        g = scan.geometry
        beams = (g.angle_min, g.angle_increment, g.time_increment, g.range_min, g.range_max)
        rows, reflector, descriptor = self._core.observe(scan.stamp, scan.ranges, scan.intensities, beams)
        return Observations(
            stamp=rows[:, 0],
            range=rows[:, 1],
            bearing=rows[:, 2],
            covariance=rows[:, 3:7].reshape(-1, 2, 2),
            kind=_KINDS[reflector.astype(np.intp)],
            orientation=rows[:, 7],
            descriptor=descriptor,
            landmark=np.full(len(rows), -1),
        )


def beams_of(scan: LaserScan) -> Beams:
    """Return angle_min, angle_increment, range_min, range_max."""
    g = scan.geometry
    return g.angle_min, g.angle_increment, g.range_min, g.range_max


def _cells(values: Any, count: int) -> NDArray[np.uint8]:
    if values is None:
        return np.zeros((count, 16), dtype=np.uint8)
    return np.ascontiguousarray(values, dtype=np.uint8).reshape(count, 16)
