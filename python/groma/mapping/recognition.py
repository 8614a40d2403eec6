"""Places seen before, found by their corners alone: no odometry, no first guess, no map.

Scans are registered to the last metres; local maps of a few metres of drive get corners, a GLAROT signature and
surfaces; each is compared with the earlier ones: retrieval, association, verification, decision. Every step sees the
past only.
Formulas: docs/theory/features.md and docs/theory/loop_evaluation.md. Source of the steps: Kallasi, Rizzini, IROS 2016.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groma import _core
from groma.nouns.arrays import Array
from groma.nouns.messages import LaserScan

Indices = NDArray[np.int64]

STAGES = ("track", "describe", "retrieve", "associate", "verify", "decide")


@dataclass(frozen=True, slots=True)
class Candidates:
    """The K local maps that look most like one, best first."""

    place: Indices
    """(K,) local map."""
    distance: Array
    """(K,) of the signatures, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """A motion that the corners of two local maps suggest."""

    place: int
    """The earlier local map."""
    transform: Array
    """(3,) ``T_place_map`` as x, y, theta, of the ends of both."""
    pairs: int
    """Corners paired."""


@dataclass(frozen=True, slots=True)
class LoopClosure:
    """What was made of the best motion of one local map."""

    place: int
    """The earlier local map."""
    local_map: int
    """The later one."""
    transform: Array
    """(3,) ``T_place_map`` as x, y, theta, of the ends of both, registered."""
    reason: str
    """Why it was not accepted; empty when it was."""
    pairs: int
    """Corners paired."""
    overlap: float
    """Share of the points in common view that agree, 0 to 1."""
    share: float
    """Share of the later map's surface that lies on that of the earlier one."""
    common: float
    """Share of the surfaces that is in common view."""

    @property
    def accepted(self) -> bool:
        """Whether it counts."""
        return not self.reason


@dataclass(frozen=True, slots=True)
class Recognition:
    """What was found in N scans, of which M could be used, with L local maps."""

    used: NDArray[np.bool_]
    """(N,) whether the scan could be used."""
    tracked: Array
    """(M, 3) pose of the vehicle as tracked, no loop closed."""
    driven: Array
    """(M,) path up to the scan [m]."""
    local_map: Indices
    """(M,) the last local map that ended up to the scan; -1 before the first."""
    first: Indices
    """(L,) first of the M scans of each local map."""
    end: Indices
    """(L,) last one, in whose frame the map is."""
    corners: Indices
    """(L,) number of corners."""
    candidates: list[Candidates]
    """Of each local map."""
    proposals: list[list[Proposal]]
    """Of each local map, most pairs first."""
    closures: list[LoopClosure]
    """In order of the later local map, one for each at most."""
    seconds: Mapping[str, float]
    """Wall time of each of ``STAGES``."""


def recognition_defaults() -> dict[str, Any]:
    """Return the settings of :func:`recognize` with their defaults, in metres and radians."""
    defaults: dict[str, Any] = json.loads(_core.recognition_defaults())
    return defaults


def recognize(
    scans: Iterable[LaserScan],
    mount: tuple[float, float, float] = (0.0, 0.0, 0.0),
    progress: Callable[[int], None] | None = None,
    **options: object,
) -> Recognition:
    """Find the places that a drive returns to.

    Parameters
    ----------
    scans
        In order of time.
    mount
        Pose x, y, yaw of the laser on the vehicle.
    progress
        Called with the number of scans tracked.
    **options
        See :func:`recognition_defaults`; tables within it may be given in part.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range.
    """
    core = _core.Recognizer(json.dumps(options))
    seconds: dict[str, float] = {}
    with _timed("track", seconds):
        used = _tracked(core, scans, mount, progress)
    with _timed("describe", seconds):
        maps = np.array(core.describe(), dtype=np.int64).reshape(-1, 3)
    with _timed("retrieve", seconds):
        candidates = core.retrieve()
    with _timed("associate", seconds):
        proposals = core.associate()
    with _timed("verify", seconds):
        core.verify()
    with _timed("decide", seconds):
        closures = core.decide()
    rows = core.scans()
    keyframe = np.array([row[1] for row in rows], dtype=np.int64)
    return Recognition(
        used=used,
        tracked=np.array([row[0] for row in rows]).reshape(-1, 3),
        driven=np.array([row[2] for row in rows]),
        local_map=np.searchsorted(maps[:, 1], keyframe, side="right") - 1,
        first=np.searchsorted(keyframe, maps[:, 0]),
        end=np.searchsorted(keyframe, maps[:, 1]),
        corners=maps[:, 2],
        candidates=[_candidates(found) for found in candidates],
        proposals=[[Proposal(place, np.array(x), pairs) for place, x, pairs in found] for found in proposals],
        closures=[_closure(row) for row in closures],
        seconds=seconds,
    )


def _tracked(
    core: _core.Recognizer,
    scans: Iterable[LaserScan],
    mount: tuple[float, float, float],
    progress: Callable[[int], None] | None,
) -> NDArray[np.bool_]:
    used = []
    for scan in scans:
        g = scan.geometry
        beams = (g.angle_min, g.angle_increment, g.time_increment, g.range_min, g.range_max)
        used.append(core.push_scan(scan.stamp, scan.ranges, beams, mount))
        if progress:
            progress(len(used))
    return np.array(used, dtype=np.bool_)


@contextmanager
def _timed(stage: str, seconds: dict[str, float]) -> Iterator[None]:
    start = perf_counter()
    yield
    seconds[stage] = perf_counter() - start


def _closure(row: tuple[int, int, tuple[float, float, float], str, int, float, float, float]) -> LoopClosure:
    place, local_map, transform, reason, pairs, overlap, share, common = row
    return LoopClosure(place, local_map, np.array(transform), reason, pairs, overlap, share, common)


def _candidates(found: list[tuple[int, float]]) -> Candidates:
    table = np.array(found).reshape(-1, 2)
    return Candidates(table[:, 0].astype(np.int64), table[:, 1])
