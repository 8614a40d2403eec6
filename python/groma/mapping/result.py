"""The result of mapping a recording: values only, ready to be written, drawn or evaluated.

Frames: poses are ``T_map_base`` as ``(x, y, theta)``; the first node is the origin of the map frame.
Covariances of nodes are those of the body-frame perturbation ``T * exp(xi)``, ``xi = (x, y, theta)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma.nouns.arrays import Array
from groma.nouns.findings import Finding
from groma.nouns.maps import Landmarks, OccupancyGrid


@dataclass(frozen=True, slots=True)
class PoseGraph:
    """Nodes and edges of the optimised graph."""

    stamps: Array
    """(N,) seconds."""
    poses: Array
    """(N, 3)."""
    covariances: Array
    """(N, 3, 3), relative to the first node."""
    pairs: NDArray[np.int64]
    """(M, 2) from, to."""
    measurements: Array
    """(M, 3) ``T_from_to``."""
    information: Array
    """(M, 3, 3)."""
    kinds: tuple[str, ...]
    """M of ``odometry``, ``registration``, ``closure``."""
    chi_squares: Array
    """(M,) squared Mahalanobis residual, 3 degrees of freedom."""


@dataclass(frozen=True, slots=True)
class Closure:
    """A loop closure that was verified, or was rejected after verification began."""

    from_stamp: float
    to_stamp: float
    from_xy: tuple[float, float]
    """Where the two local maps lie in the final map [m]."""
    to_xy: tuple[float, float]
    accepted: bool
    reason: str
    """Why it was rejected; empty when accepted."""
    overlap: float
    """Share of the points in common view that lie on the other's surfaces, 0..1."""
    correction_m: float
    """How far the closure moved the prediction [m]."""
    residual_m: float
    """Residual of it after optimisation [m]."""
    residual_rad: float


@dataclass(frozen=True, slots=True)
class WeakSpot:
    """A stretch of the drive where the map is poorly held."""

    from_stamp: float
    to_stamp: float
    xy: tuple[float, float]
    sigma_m: float
    """Standard deviation along the weakest direction of the registration [m]."""
    direction: float
    """That direction in the map frame [rad]."""
    why: str
    """In words: corridor without ends, no returns, odometry and scans disagree, ..."""


@dataclass(frozen=True, slots=True)
class MapResult:
    """Everything that `groma map` writes."""

    graph: PoseGraph
    trajectory_stamps: Array
    """(K,) at the rate of the odometry (of the scans when there is none)."""
    trajectory: Array
    """(K, 3) final poses."""
    odometry: Array
    """(K, 3) odometry alone, started at the first pose; NaN rows when there is none."""
    tracked: Array
    """(K, 3) registration alone, before any loop closure."""
    closures: tuple[Closure, ...]
    grid: OccupancyGrid
    landmarks: Landmarks
    weak: tuple[WeakSpot, ...]
    counts: dict[str, float]
    """Scans read, used and skipped with the reason, local maps, candidates, path length, ..."""
    findings: tuple[Finding, ...] = ()
    """What the core noticed on the way and in the result."""
    verdict: str = "consistent"
    """The word that follows from them."""
