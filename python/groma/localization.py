"""A vehicle on a landmark map: predict with its motions, update with the corners and reflectors of its scans.

>>> import numpy as np
>>> from groma.localization import Localizer, Observations, reflectors
>>> marks = reflectors([[4.0, 0.0], [0.0, 3.0], [5.0, 4.0]], sigma=0.002)
>>> here = Localizer(marks, pose=(0.0, 0.0, 0.0), covariance=np.diag([0.1, 0.1, 0.05]) ** 2)
>>> here.predict(0.1, (0.1, 0.0, 0.0), np.diag([1e-3, 1e-3, 1e-3]) ** 2)
>>> sigma = (0.012, 0.002)
>>> seen = Observations.make(0.1, range=[3.9, 3.0, 6.3], bearing=[0.0, 1.6, 0.68], sigma=sigma, kind="reflector")
>>> here.update(seen).landmark.tolist()
[0, 1, 2]
>>> here.state.quality.status
'tracking'

A step takes some tens of microseconds with tens of observations (see BENCHMARKS.md): it fits in the loop of a sensor.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groma import _core
from groma.localization_options import LocalizerOptions as LocalizerOptions
from groma.mapping import Landmarks
from groma.models import LaserScan

Array = NDArray[np.float64]
Pose = tuple[float, float, float]
Status = Literal["lost", "coasting", "tracking"]
Kind = Literal["corner", "reflector"]


def localizer_defaults() -> LocalizerOptions:
    """Return the default settings of :class:`Localizer`."""
    return cast(LocalizerOptions, json.loads(_core.localization_defaults()))


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
    """(N, 16) binary shape context as :func:`groma.features.bsc` gives it; zeros where there is none."""
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
            bearing=_shaped("bearing", bearing, (n,)),
            covariance=np.tile(one, (n, 1, 1)) if covariance is None else _shaped("covariance", covariance, (n, 2, 2)),
            kind=np.broadcast_to(np.asarray(kind, dtype=np.str_), n).copy(),
            orientation=np.full(n, np.nan) if orientation is None else _shaped("orientation", orientation, (n,)),
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
        """Make observations of points in the laser frame, such as :class:`groma.features.Keypoints`.

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
        x, y = np.asarray(point, dtype=np.float64).reshape(-1, 2).T
        r = np.hypot(x, y)
        with np.errstate(divide="ignore", invalid="ignore"):  # a point on the laser is refused by the localizer
            j = np.stack([np.stack([x / r, y / r], -1), np.stack([-y / r**2, x / r**2], -1)], axis=1)
            c = j @ _shaped("covariance", covariance, (len(r), 2, 2)) @ j.transpose(0, 2, 1)
        c = 0.5 * (c + c.transpose(0, 2, 1))
        angles = np.arctan2(y, x)
        return cls.make(stamp, r, angles, covariance=c, kind=kind, orientation=orientation, descriptor=descriptor)


@dataclass(frozen=True, slots=True)
class Quality:
    """What a pose is worth: to slow down or stop the vehicle by."""

    status: Status
    """``tracking``: landmarks hold the pose; ``coasting``: none does at present; ``lost``: it was never known, or
    evidence says that it is wrong."""
    observed: int
    """Observations of the last scan that could be used."""
    matched: int
    """Those that were paired with a landmark that holds the pose."""
    matched_share: float
    """Share matched in the last some hundred observations."""
    nis: float
    """Sum of squared innovations of the last scan: chi-square with ``dof`` degrees of freedom if all is well."""
    dof: int
    sigma_position: float
    """Standard deviation of the position along its weakest direction [m]."""
    sigma_heading: float
    """Standard deviation of the heading [rad]."""
    geometry: float
    """Standard deviation along the weakest direction from the last scan alone [m]; infinite below two landmarks."""
    lost_evidence: float
    """Logarithm of the likelihood ratio of being lost against being right."""


@dataclass(frozen=True, slots=True)
class State:
    """The vehicle at a time."""

    stamp: float
    """[s]."""
    pose: Pose
    """``T_map_base`` as x, y [m], theta [rad]."""
    covariance: Array
    """(3, 3) of the body-frame perturbation ``T * exp(xi)``."""
    quality: Quality


@dataclass(frozen=True, slots=True)
class Update:
    """What a scan brought: M pairings."""

    observation: NDArray[np.int64]
    """(M,) place in the observations."""
    landmark: NDArray[np.int64]
    """(M,) place in the map, or a number beyond for a landmark found on the way."""
    holds: NDArray[np.bool_]
    """(M,) whether the landmark holds the pose; one on trial does not."""
    innovation: Array
    """(M, 2) range [m] and bearing [rad], measured less predicted."""
    covariance: Array
    """(M, 2, 2) of the innovation."""
    begun: int
    """Landmarks begun,"""
    proven: int
    """that hold the pose from now on,"""
    forgotten: int
    """and forgotten."""
    unusable: int
    """Observations not finite, without range or covariance, or out of range."""
    cut_short: bool
    """Whether the joint search met its cap and nearest neighbours were taken."""
    relocated: float | None
    """The probability with which the place was found anew, where it was."""
    quality: Quality


class Localizer:
    """A vehicle on a map of corners and reflectors.

    Parameters
    ----------
    landmarks
        The static map; empty for none.
    stamp
        Time of the start [s].
    pose
        ``T_map_base`` at the start as x, y [m], theta [rad]; left out, it is not known.
    covariance
        (3, 3) of its body-frame perturbation; 1 cm and 1 degree when left out.
    mount
        ``T_base_laser`` as x, y [m], yaw [rad].
    calibration
        (8, 8) covariance of the calibration: five parameters of the drive in the order of the vehicle, then the
        body-frame perturbation of the mount. With it the filter takes into account that these are not known exactly
        (it does not estimate them).
    **options
        See :class:`LocalizerOptions`.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range, or the map or the start cannot be used.
    """

    def __init__(
        self,
        landmarks: Landmarks,
        *,
        stamp: float = 0.0,
        pose: Pose | None = None,
        covariance: ArrayLike | None = None,
        mount: Pose = (0.0, 0.0, 0.0),
        calibration: ArrayLike | None = None,
        **options: Unpack[LocalizerOptions],
    ) -> None:
        p = (
            np.diag([0.01, 0.01, np.radians(1.0)]) ** 2
            if covariance is None
            else _shaped("covariance", covariance, (3, 3))
        )
        c = None if calibration is None else _shaped("calibration", calibration, (8, 8))
        counts = np.column_stack([landmarks.seen, landmarks.visible]).astype(np.float64)
        flat = landmarks.covariances.reshape(-1, 4)
        rows = np.column_stack([landmarks.positions, flat, landmarks.orientations, counts])
        reflector = landmarks.kinds == "reflector"
        self._core = _core.Localizer(
            np.ascontiguousarray(rows), reflector, landmarks.descriptors, stamp, pose, p, mount, c, json.dumps(options)
        )

    def predict(self, stamp: float, motion: Pose, covariance: ArrayLike, by_drive: ArrayLike | None = None) -> None:
        """Move the vehicle.

        Parameters
        ----------
        stamp
            When the motion ends [s]; it began when the one before ended.
        motion
            ``T_before_after`` as x, y [m], theta [rad].
        covariance
            (3, 3) of its body-frame perturbation.
        by_drive
            (3, 5) its body-frame perturbation by the parameters of the drive, where the calibration is considered.

        Raises
        ------
        ValueError
            If time goes back or a number is not finite; nothing has changed then.
        """
        j = None if by_drive is None else _shaped("by_drive", by_drive, (3, 5))
        self._core.predict(stamp, motion, _shaped("covariance", covariance, (3, 3)), j)

    def update(self, observations: Observations, scan: LaserScan | None = None) -> Update:
        """Take in the corners and reflectors of a scan.

        Parameters
        ----------
        observations
            What was detected, each at the time of its beam.
        scan
            The scan itself, which tells what else was in view: without it no landmark found on the way is ever missed,
            only forgotten with time and way.
        """
        o = observations
        rows = np.column_stack([o.stamp, o.range, o.bearing, o.covariance.reshape(-1, 4), o.orientation])
        beams = None
        if scan is not None:
            g = scan.geometry
            beams = (g.angle_min, g.angle_increment, g.range_min, g.range_max), scan.ranges
        found = self._core.update(np.ascontiguousarray(rows), o.kind == "reflector", o.descriptor, o.landmark, beams)
        return Update(**found | {"quality": Quality(**found["quality"])})

    def relocate(self, pose: Pose, covariance: ArrayLike) -> None:
        """Put the vehicle elsewhere: its pose was found another way.

        Landmarks found on the way are forgotten.

        Raises
        ------
        ValueError
            If a number is not finite or the covariance is none; nothing has changed then.
        """
        self._core.relocate(pose, _shaped("covariance", covariance, (3, 3)))

    @property
    def state(self) -> State:
        """Where the vehicle is, at the time of the last motion."""
        stamp, pose, covariance = self._core.state()
        return State(stamp, pose, covariance, Quality(**self._core.quality()))

    @property
    def found(self) -> tuple[int, int]:
        """Landmarks found on the way that hold the pose, and those on trial."""
        return self._core.found()


def reflectors(positions: ArrayLike, sigma: float) -> Landmarks:
    """Return a map of surveyed reflectors.

    Parameters
    ----------
    positions
        (L, 2) in the map [m].
    sigma
        Standard deviation of each coordinate [m].
    """
    points = np.asarray(positions, dtype=np.float64).reshape(-1, 2)
    n = len(points)
    ones = np.ones(n, dtype=np.int64)
    return Landmarks(
        kinds=np.full(n, "reflector"),
        positions=points,
        covariances=np.tile(np.eye(2) * sigma**2, (n, 1, 1)),
        orientations=np.full(n, np.nan),
        descriptors=np.zeros((n, 16), dtype=np.uint8),
        seen=ones,
        visible=ones,
    )


def _shaped(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}: it must be {shape}")
    return array


def _cells(values: Any, count: int) -> NDArray[np.uint8]:
    if values is None:
        return np.zeros((count, 16), dtype=np.uint8)
    return np.ascontiguousarray(values, dtype=np.uint8).reshape(count, 16)
