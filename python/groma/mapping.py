"""The result of mapping a recording: values only, ready to be written, drawn or evaluated.

Frames: poses are ``T_map_base`` as ``(x, y, theta)``; the first node is the origin of the map frame.
Covariances of nodes are those of the body-frame perturbation ``T * exp(xi)``, ``xi = (x, y, theta)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma.bounds import require, require_all
from groma.findings import Finding

Array = NDArray[np.float64]


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
    """What is left of it after optimisation [m]."""
    residual_rad: float


@dataclass(frozen=True, slots=True)
class OccupancyGrid:
    """Row 0 is the bottom."""

    resolution: float
    origin: tuple[float, float]
    """Lower-left corner of the lower-left cell [m]."""
    cells: NDArray[np.int8]
    """(H, W): -1 unknown, 0 free, 100 occupied."""

    def __post_init__(self) -> None:
        require("resolution", "resolution", self.resolution)
        require_all("coordinate", "origin", self.origin)
        require("cells", "cells", self.cells.size)
        require_all("coordinate", "extent", [side * self.resolution for side in self.cells.shape])


@dataclass(frozen=True, slots=True)
class Landmarks:
    """Corner features and reflectors in the map frame."""

    kinds: NDArray[np.str_]
    """(L,) ``corner`` or ``reflector``."""
    positions: Array
    """(L, 2)."""
    covariances: Array
    """(L, 2, 2)."""
    orientations: Array
    """(L,) direction into which the corner opens; NaN where it was not measured."""
    descriptors: NDArray[np.uint8]
    """(L, 16) binary shape context as :func:`groma.features.bsc` gives it; zeros where there is none."""
    seen: NDArray[np.int64]
    """(L,) scans in which it was detected."""
    visible: NDArray[np.int64]
    """(L,) scans in which it was in view."""

    def __post_init__(self) -> None:
        require_all("coordinate", "position", self.positions)
        require_all("variance", "covariance", self.covariances)
        require_all("angle", "orientation", self.orientations, or_nan=True)


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


def no_landmarks() -> Landmarks:
    """Return a map without landmarks."""
    none = np.zeros(0)
    whole = np.zeros(0, dtype=np.int64)
    cells = np.zeros((0, 16), dtype=np.uint8)
    return Landmarks(none.astype(np.str_), none.reshape(0, 2), none.reshape(0, 2, 2), none, cells, whole, whole)


def chosen(landmarks: Landmarks, keep: NDArray[np.bool_] | Sequence[int]) -> Landmarks:
    """Return some landmarks."""
    return Landmarks(*(getattr(landmarks, name)[keep] for name in Landmarks.__slots__))


def joined(a: Landmarks, b: Landmarks) -> Landmarks:
    """Return the landmarks of both."""
    return Landmarks(*(np.concatenate([getattr(a, name), getattr(b, name)]) for name in Landmarks.__slots__))
