"""Repeatability of keypoints, raw and beyond chance; how many there are, how short-lived, how fast they are found.

Protocol (docs/theory/feature_evaluation.md): a keypoint p of scan i, predicted in scan j by the poses,

    q = T_map_j^-1 T_map_i p,

counts when it is visible for j (``feature_visibility.py``); it is found again within eps when a keypoint of j lies at
most eps from q. Pairs: j among the 40 scans after i, lasers 0.3 to 2 m apart. Then

    R(eps) = found again / visible                          over all keypoints of all pairs
    C(eps) = the same for q moved 0.6 m along the scan to either side
    corrected(eps) = (R - C) / (1 - C)

so that a detector that fires everywhere gets nothing for it. The same from j into i is given beside it (backward).
Errors of the poses count as errors of the detector; keypoints are not matched one to one.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from groma.errors import EstimationError
from groma.evaluation.feature_landmarks import sightings
from groma.evaluation.feature_scans import PosedScans
from groma.evaluation.feature_visibility import Views
from groma.features.corners import Keypoints, falko_batch
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry
from groma.nouns.poses import compose, from_polar, polar, relative

Indices = NDArray[np.int64]
Detect = Callable[[Sequence[Array], BeamGeometry], list[Keypoints]]
"""Finds the keypoints of scans of one geometry."""

WINDOW = 40
"""How many of the following scans a scan is paired with."""
LEAST_M, MOST_M = 0.3, 2.0
"""Distance of the lasers of a pair [m]."""
SHIFT_M = 0.6
"""How far predictions are moved to learn what chance finds [m]."""
TOLERANCES_M = (0.1, 0.2)
"""Tolerances at which figures are told [m]."""
_PASSES = 5


@dataclass(frozen=True, slots=True)
class Repeatability:
    """Distances from predictions to the nearest keypoint, infinite where there is none."""

    distance: Array
    """(P,) of the visible predictions [m]."""
    moved: Array
    """(M,) of the predictions that were moved [m]."""
    pairs: int
    """Pairs of scans."""

    def raw(self, tolerance: float) -> float:
        """Return R."""
        return float(np.mean(self.distance <= tolerance))

    def chance(self, tolerance: float) -> float:
        """Return C."""
        return float(np.mean(self.moved <= tolerance))

    def corrected(self, tolerance: float) -> float:
        """Return (R - C) / (1 - C); NaN when C is 1."""
        chance = self.chance(tolerance)
        return (self.raw(tolerance) - chance) / (1 - chance) if chance < 1 else float("nan")


@dataclass(frozen=True, slots=True)
class FeatureEvaluation:
    """The results of a detector on one recording."""

    scans: PosedScans
    keypoints: int
    forward: Repeatability
    """From a scan into later ones."""
    backward: Repeatability
    """From a scan into earlier ones."""
    sightings: Indices
    """(L,) scans that saw each landmark."""
    seconds_per_scan: float
    """Time of the detection, best of five passes over all scans, divided by their number."""
    threads: int
    """Threads that shared the work."""

    @property
    def keypoints_per_scan(self) -> float:
        """Mean number of keypoints."""
        return self.keypoints / len(self.scans.scans)

    @property
    def ephemeral_share(self) -> float:
        """Share of the landmarks that one scan alone saw."""
        return float(np.mean(self.sightings == 1))


def evaluate_features(scans: PosedScans, detect: Detect = falko_batch) -> FeatureEvaluation:
    """Evaluate a detector on the scans of one recording.

    Parameters
    ----------
    scans
        At least two.
    detect
        The detector; ``functools.partial(falko_batch, a=0.3)`` has other settings.

    Raises
    ------
    EstimationError
        When no keypoint of a pair of scans is visible in the other, so that there is nothing to repeat.
    """
    found, seconds = _detected(scans, detect)
    points = [keypoints.point for keypoints in found]
    views = Views(scans.scans)
    forward, backward = (repeatability(views, scans.poses, points, back) for back in (False, True))
    if not all(len(part) for way in (forward, backward) for part in (way.distance, way.moved)):
        raise EstimationError(
            f"{scans.name}: nothing to repeat: of {len(scans.scans)} scans with {sum(map(len, points))} keypoints, "
            f"{forward.pairs} pairs are {LEAST_M:g} to {MOST_M:g} m apart within {WINDOW} scans"
        )
    seen = sightings(*_in_map(scans.poses, points))
    return FeatureEvaluation(scans, sum(map(len, points)), forward, backward, seen, seconds, _threads())


def repeatability(views: Views, poses: Array, points: list[Array], backward: bool) -> Repeatability:
    """Return how often keypoints are found again.

    Parameters
    ----------
    views
        The S scans.
    poses
        (S, 3) T_map_laser.
    points
        Of each scan, its (K, 2) keypoints in its own frame [m].
    backward
        Predict from the later scan of a pair into the earlier one.
    """
    true, moved, pairs = [np.empty(0)], [np.empty(0)], 0
    flat, counts = np.concatenate([np.empty((0, 2)), *points]), np.array([len(p) for p in points])
    for early, late in _pairs(poses):
        i, j = (late, early) if backward else (early, late)
        pairs += len(i)
        target, rho, phi = _visible_predictions(views, poses, flat, counts, i, j)
        true.append(_nearest(flat, counts, target, rho, phi))
        for side in (1.0, -1.0):
            moved.append(_nearest(flat, counts, *_along_the_scan(views, target, rho, phi, side)))
    return Repeatability(np.concatenate(true), np.concatenate(moved), pairs)


def _pairs(poses: Array) -> Iterator[tuple[Indices, Indices]]:
    """Yield the pairs, earlier and later scan, by how many scans lie between."""
    for lag in range(1, min(WINDOW, len(poses) - 1) + 1):
        way = np.hypot(*(poses[lag:, :2] - poses[:-lag, :2]).T)
        early = np.flatnonzero((way >= LEAST_M) & (way <= MOST_M))
        yield early, early + lag


def _visible_predictions(
    views: Views, poses: Array, flat: Array, counts: Indices, i: Indices, j: Indices
) -> tuple[Indices, Array, Array]:
    """Return scan, range and bearing of the visible predictions of the keypoints of scans i in scans j."""
    pair, keypoint = _members(counts, i)
    there = compose(relative(poses[j], poses[i])[pair], np.pad(flat[keypoint], ((0, 0), (0, 1))))
    rho, phi = polar(there)
    visible = views.visible(j[pair], rho, phi)
    return j[pair][visible], rho[visible], phi[visible]


def _along_the_scan(views: Views, target: Indices, rho: Array, phi: Array, side: float) -> tuple[Indices, Array, Array]:
    """Move points by the angle of a chord of 0.6 m, to where the scan sees the surface; drop those with none."""
    far = rho > SHIFT_M / 2
    target, bearing = target[far], phi[far] + side * 2 * np.arcsin(SHIFT_M / 2 / rho[far])
    surface = views.surface(target, bearing)
    seen = np.isfinite(surface)
    return target[seen], surface[seen], bearing[seen]


def _nearest(flat: Array, counts: Indices, target: Indices, rho: Array, phi: Array) -> Array:
    """Return the distance of each point to the nearest keypoint of its scan."""
    owner, keypoint = _members(counts, target)
    xy = from_polar(rho, phi)
    distance = np.full(len(target), np.inf)
    np.minimum.at(distance, owner, np.hypot(*(flat[keypoint] - xy[owner]).T))
    return distance


def _members(counts: Indices, scans: Indices) -> tuple[Indices, Indices]:
    """Return all keypoints of scans (P,): the place in ``scans`` and the index of the keypoint, scan after scan."""
    sizes = counts[scans]
    owner = np.repeat(np.arange(len(scans)), sizes)
    start = np.cumsum(counts) - counts
    within = np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return owner, start[scans][owner] + within


def _in_map(poses: Array, points: list[Array]) -> tuple[Array, Indices]:
    scan = np.repeat(np.arange(len(points)), [len(p) for p in points])
    flat = np.concatenate([np.empty((0, 2)), *points])
    return compose(poses[scan], np.pad(flat, ((0, 0), (0, 1))))[:, :2], scan


def _detected(scans: PosedScans, detect: Detect) -> tuple[list[Keypoints], float]:
    """Return the keypoints of each scan and the time for one."""
    found: dict[int, Keypoints] = {}
    seconds = 0.0
    for geometry, members in _by_geometry(scans).items():
        ranges = [scans.scans[k].ranges for k in members]
        times = []
        for _ in range(_PASSES):
            start = perf_counter()
            batch = detect(ranges, geometry)
            times.append(perf_counter() - start)
        seconds += min(times)
        found.update(zip(members, batch, strict=True))
    return [found[k] for k in range(len(scans.scans))], seconds / len(scans.scans)


def _by_geometry(scans: PosedScans) -> dict[BeamGeometry, list[int]]:
    """Group scans, for some scanners tell a new first bearing with every sweep."""
    groups: dict[BeamGeometry, list[int]] = {}
    for k, scan in enumerate(scans.scans):
        groups.setdefault(replace(scan.geometry, time_increment=0.0), []).append(k)
    return groups


def _threads() -> int:
    told = os.environ.get("RAYON_NUM_THREADS", "")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return int(told) if told.isdigit() and int(told) > 0 else cores
