"""The result of mapping a recording: values only, ready to be written, drawn or evaluated.

Frames: poses are ``T_map_base`` as ``(x, y, theta)``; the first node is the origin of the map frame.
Covariances of nodes are those of the body-frame perturbation ``T * exp(xi)``, ``xi = (x, y, theta)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma.nouns.arrays import Array
from groma.nouns.bounds import require, require_all


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
    """(L, 16) binary shape context as :func:`groma.features.corners.bsc` gives it; zeros where there is none."""
    seen: NDArray[np.int64]
    """(L,) scans in which it was detected."""
    visible: NDArray[np.int64]
    """(L,) scans in which it was in view."""

    def __post_init__(self) -> None:
        require_all("coordinate", "position", self.positions)
        require_all("variance", "covariance", self.covariances)
        require_all("angle", "orientation", self.orientations, or_nan=True)


@dataclass(frozen=True, slots=True)
class Chart:
    """The map that a drive is localized in."""

    landmarks: Landmarks
    grid: OccupancyGrid | None = None
    """None where the map is a list of reflectors."""

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing on it."""
        return self.grid is None and not len(self.landmarks.seen)


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


def landmark_rows(landmarks: Landmarks) -> tuple[Array, NDArray[np.bool_], NDArray[np.uint8]]:
    """Return the map as the core takes it."""
    counts = np.column_stack([landmarks.seen, landmarks.visible]).astype(np.float64)
    flat = landmarks.covariances.reshape(-1, 4)
    rows = np.column_stack([landmarks.positions, flat, landmarks.orientations, counts])
    return np.ascontiguousarray(rows), landmarks.kinds == "reflector", np.ascontiguousarray(landmarks.descriptors)
