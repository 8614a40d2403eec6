"""Where on a map the vehicle is, without any first guess.

>>> from groma.localization.localizer import Observations, reflectors
>>> from groma.localization.relocalizer import Relocalizer
>>> marks = reflectors([[4.0, 0.0], [0.0, 3.0], [5.0, 4.0], [-3.0, 1.0], [-2.0, -4.0]], sigma=0.002)
>>> seen = Observations.at_points(0.0, marks.positions - [1.0, 0.5], marks.covariances, kind="reflector")
>>> best = Relocalizer(marks).locate(seen)[0]
>>> [round(v, 3) for v in best.pose], best.pairs, best.probability > 0.99
([1.0, 0.5, 0.0], 5, True)
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Unpack, cast

import numpy as np

from groma import _core
from groma.localization.observations import Observations, beams_of
from groma.localization.options import RelocalizeOptions
from groma.nouns.arrays import Array
from groma.nouns.maps import Landmarks, OccupancyGrid, landmark_rows
from groma.nouns.messages import LaserScan
from groma.nouns.poses import Pose


def relocalizer_defaults() -> RelocalizeOptions:
    """Return the default settings of :class:`Relocalizer`."""
    return cast(RelocalizeOptions, json.loads(_core.localization_defaults()[1]))


@dataclass(frozen=True, slots=True)
class Located:
    """A place where the vehicle may be."""

    pose: Pose
    """``T_map_base`` as x, y [m], theta [rad]."""
    covariance: Array
    """(3, 3) of the body-frame perturbation."""
    evidence: float
    """Logarithm of the likelihood ratio against chance."""
    probability: float
    """That it is right, among all places found, those not found, and places not on the map."""
    pairs: int
    """Seen landmarks paired with landmarks of the map."""


class Relocalizer:
    """A map that places are looked for on.

    Parameters
    ----------
    landmarks
        The static map.
    grid
        Its occupancy, if there is one: places are looked for on its walls as well, and the beams of a scan speak.
    **options
        See :class:`groma.localization.options.RelocalizeOptions`.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range, or the map cannot be used.
    """

    def __init__(
        self, landmarks: Landmarks, grid: OccupancyGrid | None = None, **options: Unpack[RelocalizeOptions]
    ) -> None:
        cells = None if grid is None else (grid.resolution, grid.origin, np.ascontiguousarray(grid.cells))
        self.core = _core.Relocalizer(*landmark_rows(landmarks), cells, json.dumps(options))

    def locate(
        self, observations: Observations, scan: LaserScan | None = None, mount: Pose = (0.0, 0.0, 0.0)
    ) -> list[Located]:
        """Return where the vehicle may be, most probable first.

        Parameters
        ----------
        observations
            Corners and reflectors of one scan.
        scan
            The scan itself.
        mount
            ``T_base_laser`` as x, y [m], yaw [rad].
        """
        o = observations
        beams = None if scan is None else (beams_of(scan), scan.ranges)
        found = self.core.locate(o.rows(), o.kind == "reflector", o.descriptor, beams, mount)
        return [Located(*row) for row in found]
