"""A map result as mapping would give it, made up: two laps through a ring of corridors, with drift and closures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from groma.mapping.result import Closure, MapResult, PoseGraph, WeakSpot
from groma.nouns import poses as se2
from groma.nouns.maps import Landmarks, OccupancyGrid

Array = NDArray[np.float64]

WIDTH, HEIGHT, HALF = 44.0, 30.0, 1.25
START = 1.6e9


def ring_corridor(poses: int = 3000, laps: int = 2, closures: int = 24, seed: int = 7) -> MapResult:
    """Return a result; everything in it follows from the seed."""
    rng = np.random.default_rng(seed)
    drive = _drive(poses, laps)
    stamps = START + np.linspace(0, 2 * len(drive) / 10, len(drive))
    tracked = _drifted(drive, rng, [2e-4, 4e-4, 3e-4], 1.0)
    odometry = _drifted(drive, rng, [1e-3, 1e-3, 2e-3], 1.015)
    nodes = np.arange(0, len(drive), max(1, len(drive) // 300))
    return MapResult(
        _graph(stamps[nodes], drive[nodes], rng),
        stamps,
        drive,
        odometry,
        tracked,
        _closures(drive, stamps, tracked, closures, laps, rng),
        _grid(rng),
        _landmarks(rng),
        _weak(drive, stamps),
        {"scans_read": 6012.0, "scans_used": 5990.0, "scans with no returns": 14.0, "scans with a late stamp": 8.0,
         "local_maps": 61.0, "candidates": 118.0, "path_m": 296.0},
    )  # fmt: skip


def _drive(count: int, laps: int) -> Array:
    """Return poses along the rounded middle of the corridor, (0, 0) first."""
    corners = np.array([[0, 0], [WIDTH, 0], [WIDTH, HEIGHT], [0, HEIGHT]]) - [WIDTH / 2, 0]
    sides = np.vstack([np.vstack([corners[1:], corners[:1]])] * laps)
    points = np.vstack([[[0.0, 0.0]], corners[1:], *[corners] * (laps - 1), corners[:1], [[0.0, 0.0]]])
    assert len(sides) == 4 * laps
    path = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.linspace(0, path[-1], count)
    window = np.ones(15) / 15
    xy = np.column_stack([np.interp(at, path, points[:, k]) for k in (0, 1)])
    padded = np.pad(xy, ((7, 7), (0, 0)), mode="edge")
    xy = np.column_stack([np.convolve(padded[:, k], window, "valid") for k in (0, 1)])
    xy[:, 1] += 0.15 * np.sin(at / 3)
    step = np.gradient(xy, axis=0)
    return np.column_stack([xy - xy[0], np.arctan2(step[:, 1], step[:, 0])])


def _drifted(drive: Array, rng: np.random.Generator, sigma: list[float], scale: float) -> Array:
    steps = se2.relative(drive[:-1], drive[1:]) * [scale, 1, 1] + rng.normal(0, sigma, (len(drive) - 1, 3))
    poses = [drive[0]]
    for step in steps:
        poses.append(se2.compose(poses[-1], step))
    return np.array(poses)


def _graph(stamps: Array, poses: Array, rng: np.random.Generator) -> PoseGraph:
    count = len(poses)
    chain = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    loops = np.column_stack([np.arange(0, count // 2, 9), count // 2 + np.arange(0, count // 2, 9)])
    loops = loops[loops[:, 1] < count]
    pairs = np.vstack([chain, chain, loops]).astype(np.int64)
    kinds = ("odometry",) * len(chain) + ("registration",) * len(chain) + ("closure",) * len(loops)
    grown = np.minimum(np.arange(count), count - np.arange(count))[:, None, None] + 1
    covariances = grown * np.diag([4e-6, 9e-6, 1e-7])
    measurements = se2.relative(poses[pairs[:, 0]], poses[pairs[:, 1]])
    information = np.tile(np.diag([1e4, 1e4, 1e5]), (len(pairs), 1, 1))
    return PoseGraph(stamps, poses, covariances, pairs, measurements, information, kinds, rng.chisquare(3, len(pairs)))


def _closures(
    drive: Array, stamps: Array, tracked: Array, count: int, laps: int, rng: np.random.Generator
) -> tuple[Closure, ...]:
    lap = len(drive) // laps
    moved = np.hypot(*(tracked[:, :2] - drive[:, :2]).T)
    made = []
    for i in np.linspace(lap // 20, lap - 2, count).astype(int) if laps > 1 else ():
        j, good = i + lap, bool(rng.random() > 0.2)
        left = float(abs(rng.normal(0, 0.015))) if good else float(moved[j] + rng.uniform(0.5, 3))
        reason = (
            ""
            if good
            else ("walls of one stand in the free space of the other" if i % 2 else "overlap too small <30 %")
        )
        made.append(
            Closure(
                float(stamps[i]),
                float(stamps[j]),
                (float(drive[i, 0]), float(drive[i, 1])),
                (float(drive[j, 0]), float(drive[j, 1])),
                good,
                reason,
                float(rng.uniform(0.6, 0.95) if good else 0.3),
                float(moved[j]) + 0.01,
                left,
                float(rng.normal(0, 0.002)),
            )
        )
    return tuple(made)


def _grid(rng: np.random.Generator) -> OccupancyGrid:
    resolution, margin = 0.05, 3.0
    origin = (-WIDTH / 2 - HALF - margin, -HALF - margin)
    shape = [round((side + 2 * (HALF + margin)) / resolution) for side in (HEIGHT, WIDTH)]
    y, x = (np.indices(shape) + 0.5) * resolution + np.array([origin[1], origin[0]])[:, None, None]
    outside = np.maximum(abs(x) - WIDTH / 2, abs(y - HEIGHT / 2) - HEIGHT / 2) - HALF
    inside = np.maximum(abs(x) - WIDTH / 2, abs(y - HEIGHT / 2) - HEIGHT / 2) + HALF
    depth = np.minimum(-outside, inside)  # into the corridor from its nearer wall
    niche = (np.mod(x, 6.0) < 1.0) & (outside > -0.1) & (outside < 0.5)
    cells = np.full(x.shape, -1, dtype=np.int8)
    cells[(depth > 0) | niche] = 0
    wall = (abs(depth) < 0.06) & ~niche & (rng.random(x.shape) > 0.08)
    cells[wall | ((abs(outside - 0.5) < 0.06) & (np.mod(x, 6.0) < 1.0))] = 100
    return OccupancyGrid(resolution, origin, cells)


def _landmarks(rng: np.random.Generator) -> Landmarks:
    x = np.repeat(np.arange(-18.0, 19.0, 6.0), 2) + np.tile([0.0, 1.0], 7)
    positions = np.vstack([np.column_stack([x, np.full(14, y)]) for y in (-HALF, HEIGHT + HALF)])
    covariances = np.tile(np.diag([1e-4, 4e-4]), (28, 1, 1))
    return Landmarks(
        np.full(28, "corner"),
        positions,
        covariances,
        rng.uniform(-3, 3, 28),
        np.zeros((28, 16), dtype=np.uint8),
        rng.integers(5, 40, 28),
        np.full(28, 60),
    )


def _weak(drive: Array, stamps: Array) -> tuple[WeakSpot, ...]:
    made = []
    for share, sigma, why in (
        (0.18, 0.21, "corridor without ends"),
        (0.33, 0.12, "corridor without ends"),
        (0.61, 0.34, "few returns & <glass>"),
    ):
        i, j = int(share * len(drive)), int((share + 0.03) * len(drive))
        xy = (float(drive[(i + j) // 2, 0]), float(drive[(i + j) // 2, 1]))
        along = float(drive[(i + j) // 2, 2])
        made.append(WeakSpot(float(stamps[i]), float(stamps[j]), xy, sigma, along, why))
    return tuple(made)
