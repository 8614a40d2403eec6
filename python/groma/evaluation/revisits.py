"""Which scans of a drive truly return to a place seen before, by the poses of a reference.

Scan i returns to scan j when

- at least ``gap`` of path lies between them, so that it is a return and not the place that was never left;
- the lasers are less than ``NEAR_M`` apart;
- they see the same: c(i, j) >= ``COMMON``, where c is the smaller of two shares: that of the hits of i that are visible
  for j, as ``feature_visibility.py`` defines it, and that of the hits of j that are visible for i.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groma.evaluation.feature_visibility import FARTHEST, NEAREST, Views
from groma.nouns.arrays import Array
from groma.nouns.messages import LaserScan
from groma.nouns.poses import compose, from_polar, polar, relative

Indices = NDArray[np.int64]

NEAR_M = 0.5
"""Lasers nearer than this may be at one place [m]."""
COMMON = 0.5
"""Least share of the hits of either scan that is visible for the other."""


def revisits(scans: Sequence[LaserScan], poses: Array, driven: Array, gap: float) -> list[Indices]:
    """Return, of every scan, the earlier scans that it returns to.

    Parameters
    ----------
    scans
        N scans in order of time.
    poses
        (N, 3) T_map_laser of the reference.
    driven
        (N,) path up to each scan [m].
    gap
        Least path between a scan and one that it returns to [m].
    """
    views = Views(scans)
    hits = [_hits(scan) for scan in scans]
    found = []
    for i, pose in enumerate(poses):
        near = np.hypot(*(poses[:i, :2] - pose[:2]).T) < NEAR_M
        earlier = np.flatnonzero(near & (driven[i] - driven[:i] >= gap))
        common = [min(_share(views, hits, poses, i, j), _share(views, hits, poses, j, i)) for j in earlier.tolist()]
        found.append(earlier[np.array(common, dtype=np.float64) >= COMMON])
    return found


def _hits(scan: LaserScan) -> Array:
    """Return the points (H, 3) where corners could be seen, the last column 0."""
    g = scan.geometry
    near, far = max(g.range_min, NEAREST), min(g.range_max, FARTHEST)
    beams = np.flatnonzero((scan.ranges >= near) & (scan.ranges <= far))
    bearing = np.asarray(g.angle_min + g.angle_increment * beams, dtype=np.float64)
    return np.column_stack([from_polar(scan.ranges[beams], bearing), np.zeros(len(beams))])


def _share(views: Views, hits: list[Array], poses: Array, i: int, j: int) -> float:
    """Return the share of the hits of scan i that are visible for scan j."""
    if not len(hits[i]):
        return 0.0
    there = compose(relative(poses[j], poses[i])[None], hits[i])
    rho, phi = polar(there)
    return float(np.mean(views.visible(np.full(len(rho), j), rho, phi)))
