"""Promote what lasts to the static map: marks that drives of several days saw where the map has none.

    same mark     of one kind, nearest within ``GATE``, opening within ``TURN``; each at most once a day
    lasting       seen on ``least_days`` days at least, each time in a share ``SHARE`` of the scans that had it in view
    position      weighted mean of the days' positions; covariance that of the mean, widened by how far the days differ:
                  P = (sum P_d^-1)^-1 max(1, chi^2 / (2 (days - 1)))

Days count as independent. The landmarks of the map stay as they are, and none is taken away: what is gone is never
paired, and ``groma localize`` tells how often each was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma.mapping import Landmarks

Array = NDArray[np.float64]

GATE = 0.2
"""Marks closer than this may be one [m]."""
TURN = np.pi / 3
"""And open into directions that differ by less than this [rad]."""
SHARE = 0.5
"""Of the scans of a day that had a mark in view, those that must have detected it."""
LEAST_SEEN = 5
"""Scans of a day that must have detected it."""


@dataclass(frozen=True, slots=True)
class Promotion:
    """The new map and how it came about."""

    landmarks: Landmarks
    """Those of the map, then the promoted ones."""
    promoted: int
    confirmed: int
    """Landmarks of the map that some day saw."""


def promote(static: Landmarks, days: Sequence[Landmarks], least_days: int = 2) -> Promotion:
    """Add to a map what several days saw and it lacks.

    Parameters
    ----------
    static
        The map.
    days
        What was seen on each day, in the frame of the map.
    least_days
        Days on which a mark must have been seen.
    """
    confirmed = np.zeros(len(static.positions), dtype=np.bool_)
    tracks: list[list[tuple[int, int]]] = []
    known = static
    for day, seen in enumerate(days):
        pairs = match(static, seen)
        confirmed[list(pairs)] = True
        fresh = [k for k in _dependable(seen) if k not in set(pairs.values())]
        _follow(tracks, days, day, fresh)
    lasting = [track for track in tracks if len(track) >= least_days]
    for track in lasting:
        known = joined(known, _fused([(days[day], k) for day, k in track]))
    return Promotion(known, len(lasting), int(confirmed.sum()))


def match(a: Landmarks, b: Landmarks) -> dict[int, int]:
    """Return which landmark of b each of a is, nearest first."""
    if not (len(a.positions) and len(b.positions)):
        return {}
    distance = np.linalg.norm(a.positions[:, None] - b.positions, axis=2)
    turn = np.abs(np.angle(np.exp(1j * (a.orientations[:, None] - b.orientations))))
    alike = (a.kinds[:, None] == b.kinds) & (np.isnan(turn) | (turn < TURN)) & (distance < GATE)
    pairs: dict[int, int] = {}
    rows, columns = np.nonzero(alike)
    for at in np.argsort(distance[rows, columns], kind="stable"):
        i, j = int(rows[at]), int(columns[at])
        if i not in pairs and j not in pairs.values():
            pairs[i] = j
    return pairs


def chosen(landmarks: Landmarks, keep: NDArray[np.bool_] | Sequence[int]) -> Landmarks:
    """Return some landmarks."""
    return Landmarks(*(getattr(landmarks, name)[keep] for name in Landmarks.__slots__))


def joined(a: Landmarks, b: Landmarks) -> Landmarks:
    """Return the landmarks of both."""
    return Landmarks(*(np.concatenate([getattr(a, name), getattr(b, name)]) for name in Landmarks.__slots__))


def _dependable(seen: Landmarks) -> list[int]:
    often = (seen.seen >= LEAST_SEEN) & (seen.seen >= SHARE * seen.visible)
    return [int(k) for k in np.flatnonzero(often)]


def _follow(tracks: list[list[tuple[int, int]]], days: Sequence[Landmarks], day: int, fresh: list[int]) -> None:
    """Let each new mark of a day go on with a track of the days before, or begin one."""
    if tracks and fresh:
        last = [chosen(days[d], [k]) for d, k in (track[-1] for track in tracks)]
        ends = last[0]
        for one in last[1:]:
            ends = joined(ends, one)
        pairs = match(ends, chosen(days[day], fresh))
    else:
        pairs = {}
    for track, k in pairs.items():
        tracks[track].append((day, fresh[k]))
    taken = set(pairs.values())
    tracks.extend([(day, mark)] for k, mark in enumerate(fresh) if k not in taken)


def _fused(sights: Sequence[tuple[Landmarks, int]]) -> Landmarks:
    """Return one landmark of what several days saw."""
    points = np.array([seen.positions[k] for seen, k in sights])
    information = np.array([np.linalg.inv(seen.covariances[k]) for seen, k in sights])
    covariance = np.linalg.inv(information.sum(axis=0))
    mean = covariance @ np.einsum("nij,nj->i", information, points)
    apart = points - mean
    chi_square = float(np.einsum("ni,nij,nj->", apart, information, apart))
    widened = covariance * max(1.0, chi_square / (2 * max(len(sights) - 1, 1)))
    first, k = sights[0]
    angles = np.array([seen.orientations[at] for seen, at in sights])
    facing = float(np.angle(np.exp(1j * angles).sum())) if np.isfinite(angles).all() else np.nan
    return Landmarks(
        kinds=first.kinds[[k]],
        positions=mean[None],
        covariances=widened[None],
        orientations=np.array([facing]),
        descriptors=first.descriptors[[k]],
        seen=np.array([sum(int(seen.seen[at]) for seen, at in sights)]),
        visible=np.array([sum(int(seen.visible[at]) for seen, at in sights)]),
    )
