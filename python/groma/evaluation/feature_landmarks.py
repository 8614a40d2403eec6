"""How many of the landmarks that a detector finds are seen only once.

Keypoints of all scans, in the frame of the map, are taken in order of time (of one scan: in order of the beams). Each
joins the landmark nearest to it within the merge radius, else becomes one. A landmark stays where it was first seen, so
that it cannot creep along a wall. What counts is the number of scans that saw it, not of keypoints.

The share depends on the merge radius and on how many scans pass by: it compares detectors on one set of scans only.
"""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import product

import numpy as np
from numpy.typing import NDArray

from groma.nouns.arrays import Array

Indices = NDArray[np.int64]

MERGE_RADIUS = 0.2
"""Farther apart are two landmarks [m]."""

_BESIDE = tuple(product((-1, 0, 1), repeat=2))


def sightings(points: Array, scan: Indices, radius: float = MERGE_RADIUS) -> Indices:
    """Return by how many scans each landmark was seen.

    Parameters
    ----------
    points
        (K, 2) keypoints in the frame of the map [m].
    scan
        (K,) scan of each, not decreasing.
    radius
        Within which keypoints are one landmark [m].
    """
    cells: dict[tuple[int, int], list[int]] = defaultdict(list)
    places: list[tuple[float, float]] = []
    seen: list[int] = []
    last: list[int] = []
    for (x, y), now in zip(points.tolist(), scan.tolist(), strict=True):
        column, row = math.floor(x / radius), math.floor(y / radius)
        near = [k for dc, dr in _BESIDE for k in cells.get((column + dc, row + dr), ())]
        best = min(near, key=lambda k: math.hypot(x - places[k][0], y - places[k][1]), default=-1)
        if best < 0 or math.hypot(x - places[best][0], y - places[best][1]) > radius:
            cells[column, row].append(len(places))
            places.append((x, y))
            seen.append(1)
            last.append(now)
        elif last[best] != now:
            seen[best] += 1
            last[best] = now
    return np.array(seen, dtype=np.int64)
