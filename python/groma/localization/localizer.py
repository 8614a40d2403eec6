"""A vehicle on a landmark map: predict with its motions, update with the corners and reflectors of its scans.

>>> import numpy as np
>>> from groma.localization.localizer import Localizer, Observations, reflectors
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
from dataclasses import dataclass
from typing import Literal, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from groma import _core
from groma._core import LocalizerUpdate as Update
from groma._core import PoseQuality as Quality
from groma.localization.observations import Observations as Observations
from groma.localization.observations import beams_of
from groma.localization.options import LocalizerOptions as LocalizerOptions
from groma.localization.relocalizer import Relocalizer as Relocalizer
from groma.localization.wheels import Wheels as Wheels
from groma.nouns.arrays import Array, shaped
from groma.nouns.maps import Landmarks, landmark_rows
from groma.nouns.messages import LaserScan
from groma.nouns.poses import Pose

Status = Literal["lost", "coasting", "tracking"]


def localizer_defaults() -> LocalizerOptions:
    """Return the default settings of :class:`Localizer`."""
    return cast(LocalizerOptions, json.loads(_core.localization_defaults()[0]))


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
    relocalizer
        With it the localizer looks for its place of its own accord while it is lost: at the start without a pose, and
        when evidence says that the pose is wrong. Where it has a grid, its walls constrain the pose while landmarks do
        so only weakly (modes static and mixed), and are evidence for and against it.
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
        relocalizer: Relocalizer | None = None,
        **options: Unpack[LocalizerOptions],
    ) -> None:
        p = (
            np.diag([0.01, 0.01, np.radians(1.0)]) ** 2
            if covariance is None
            else shaped("covariance", covariance, (3, 3))
        )
        c = None if calibration is None else shaped("calibration", calibration, (8, 8))
        search = None if relocalizer is None else relocalizer.core
        self._core = _core.Localizer(*landmark_rows(landmarks), stamp, pose, p, mount, c, search, json.dumps(options))

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
        j = None if by_drive is None else shaped("by_drive", by_drive, (3, 5))
        self._core.predict(stamp, motion, shaped("covariance", covariance, (3, 3)), j)

    def update(self, observations: Observations, scan: LaserScan | None = None) -> Update:
        """Take in the corners and reflectors of a scan.

        Parameters
        ----------
        observations
            What was detected, each at the time of its beam.
        scan
            The scan itself, which tells what else was in view: without it no landmark found during the drive is ever
            missed, only forgotten with time and way. While the place is searched for, its beams help to find it.
        """
        o = observations
        beams = None
        if scan is not None:
            beams = scan.stamp, scan.geometry.time_increment, beams_of(scan), scan.ranges
        return self._core.update(o.rows(), o.kind == "reflector", o.descriptor, o.landmark, beams)

    def relocate(self, pose: Pose, covariance: ArrayLike) -> None:
        """Put the vehicle elsewhere: its pose was found another way.

        Landmarks found during the drive are forgotten.

        Raises
        ------
        ValueError
            If a number is not finite or the covariance is none; nothing has changed then.
        """
        self._core.relocate(pose, shaped("covariance", covariance, (3, 3)))

    @property
    def state(self) -> State:
        """Where the vehicle is, at the time of the last motion."""
        stamp, pose, covariance = self._core.state()
        return State(stamp, pose, covariance, self._core.quality())

    @property
    def found(self) -> tuple[int, int]:
        """Landmarks found during the drive that constrain the pose, and those on trial."""
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
